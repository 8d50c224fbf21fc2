#include "tests/architecture/include_rules.h"

#include <algorithm>
#include <fstream>
#include <regex>

namespace comap {
namespace {

using Prefixes = std::vector<std::string>;

bool startsWithAny(const std::string& text, const Prefixes& prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](const std::string& p) { return text.starts_with(p); });
}

const Prefixes kFolders{"protocol/",    "mapping_core/", "robot_api/", "edge_agent/",
                        "fleet_tools/", "shaders/",      "tests/"};

// The first rule whose folder holds a file is that file's; of the project's own headers it may include these.
struct Layer {
  std::string folder;
  Prefixes may_include;
};
const std::vector<Layer> kLayers{
    {"protocol/types/", {"protocol/types/"}},
    {"protocol/", {"protocol/"}},
    {"mapping_core/rgbd/", {"mapping_core/rgbd/", "protocol/types/"}},
    {"mapping_core/ferns/", {"mapping_core/ferns/", "protocol/types/"}},
    {"mapping_core/", {"mapping_core/", "protocol/", "shaders/"}},
    {"robot_api/", {"robot_api/", "protocol/types/"}},
    {"edge_agent/", {"edge_agent/", "protocol/", "robot_api/wire.h", "mapping_core/rgbd/", "mapping_core/ferns/"}},
    {"fleet_tools/", {"fleet_tools/", "edge_agent/", "mapping_core/", "protocol/", "shaders/"}},
};

// Libraries that only some folders may see.
struct Fence {
  std::string library;
  Prefixes headers;
  Prefixes inside;
};
const std::vector<Fence> kFences{
    // A recording holds messages of others, with their schemas, and none of ours.
    {"Protobuf", {"google/protobuf"}, {"protocol/codec/", "protocol/link/", "protocol/ros2/", "fleet_tools/export/"}},
    {"messages", {"comap/v1/"}, {"protocol/codec/", "protocol/link/", "protocol/ros2/"}},
    {"DDS", {"fastdds/", "fastrtps/", "fastcdr/"}, {"protocol/link/", "protocol/codec/", "protocol/ros2/"}},
    {"Prometheus", {"prometheus/", "systemd/"}, {"protocol/telemetry/"}},
    {"OpenSSL", {"openssl/"}, {"protocol/keys/"}},
    {"Vulkan", {"vulkan/", "volk.h"}, {"mapping_core/gpu/", "mapping_core/surfels/"}},
};

std::string brokenRule(const std::string& file, const std::string& header) {
  for (const Fence& fence : kFences)
    if (startsWithAny(header, fence.headers) && !startsWithAny(file, fence.inside))
      return fence.library + " stays inside " + fence.inside.front();
  if (!startsWithAny(header, kFolders)) return {};
  for (const Layer& layer : kLayers)
    if (file.starts_with(layer.folder))
      return startsWithAny(header, layer.may_include) ? "" : layer.folder + " does not depend on it";
  return {};
}

bool isSource(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  return extension == ".h" || extension == ".cc" || extension == ".hpp" || extension == ".cpp" || extension == ".c";
}

}  // namespace

std::vector<std::string> includeViolations(const std::filesystem::path& root, size_t& checked) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"].*)");
  std::vector<std::string> violations;
  checked = 0;
  for (const char* folder : {"protocol", "mapping_core", "robot_api", "edge_agent", "fleet_tools"}) {
    if (!std::filesystem::is_directory(root / folder)) continue;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / folder)) {
      if (!entry.is_regular_file() || !isSource(entry.path())) continue;
      ++checked;
      const std::string file = entry.path().lexically_relative(root).generic_string();
      std::ifstream in(entry.path());
      int number = 0;
      for (std::string line; std::getline(in, line);) {
        ++number;
        std::smatch match;
        if (!std::regex_match(line, match, kInclude)) continue;
        const std::string rule = brokenRule(file, match[1].str());
        if (!rule.empty())
          violations.push_back(file + ":" + std::to_string(number) + " includes " + match[1].str() + ": " + rule);
      }
    }
  }
  std::sort(violations.begin(), violations.end());
  return violations;
}

}  // namespace comap
