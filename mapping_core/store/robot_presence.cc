// Which robots are with the core: an entry of meta each.
#include "mapping_core/store/map_store.h"
#include "mapping_core/store/map_store_state.h"

namespace comap {
namespace {

const std::string kPrefix = "robot_present_";

}  // namespace

Result<std::map<std::string, bool>> MapStore::presences() const {
  Result<Query> query = state_->database.query("SELECT key, value FROM meta WHERE key GLOB 'robot_present_*'");
  if (!query) return query.error();
  std::map<std::string, bool> result;
  for (;;) {
    const Result<bool> row = query->step();
    if (!row) return row.error();
    if (!*row) return result;
    const std::string robot = query->text().substr(kPrefix.size());
    result[robot] = query->text() == "yes";
  }
}

Result<void> MapStore::setPresent(const std::string& robot, bool present) {
  return setMeta(kPrefix + robot, present ? "yes" : "no");
}

}  // namespace comap
