#include "protocol/types/ids.h"

#include <algorithm>

namespace comap {

MapId mapIdOf(const KeyframeId& anchor) {
  return anchor.robot + "-" + std::to_string(anchor.session) + "-" + std::to_string(anchor.sequence);
}

std::string toString(const KeyframeId& id) {
  return id.robot + "/" + std::to_string(id.session) + "/" + std::to_string(id.sequence);
}

std::string robotNameProblem(const std::string& name) {
  const auto allowed = [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-'; };
  if (!name.empty() && name.size() <= 32 && std::all_of(name.begin(), name.end(), allowed)) return {};
  return "robot name '" + name + "' is not 1-32 characters of a-z, 0-9, '_' and '-'";
}

}  // namespace comap
