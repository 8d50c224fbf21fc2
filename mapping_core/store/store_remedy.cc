#include "mapping_core/store/store_remedy.h"

namespace comap {

Error withRemedy(const Error& error, const std::string& store) {
  if (error.code != ErrorCode::kBadData) return error;
  return {error.code, error.text + "; if it is a map store, 'fleet doctor " + store +
                          "' names what is damaged in it, and 'fleet recover " + store +
                          " --out NEW' saves what is whole"};
}

}  // namespace comap
