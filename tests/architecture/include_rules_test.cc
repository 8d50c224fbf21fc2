#include "tests/architecture/include_rules.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace comap {
namespace {

namespace fs = std::filesystem;

TEST(IncludeRules, theTreeKeepsThem) {
  size_t checked = 0;
  const auto violations = includeViolations(COMAP_SOURCE_DIR, checked);
  EXPECT_GT(checked, 50u) << "the sources were found";
  for (const std::string& violation : violations) ADD_FAILURE() << violation;
}

// A tree of one file with one include.
class PlantedInclude {
 public:
  PlantedInclude(const std::string& file, const std::string& include)
      : root_(fs::temp_directory_path() / ("comap_include_rules_" + std::to_string(getpid()))) {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << "// A file.\n#include " << include << "\n";
  }
  ~PlantedInclude() { fs::remove_all(root_); }
  size_t violations() const {
    size_t checked = 0;
    const size_t count = includeViolations(root_, checked).size();
    EXPECT_EQ(checked, 1u);
    return count;
  }

 private:
  fs::path root_;
};

TEST(IncludeRules, plantedViolationsAreFound) {
  const std::pair<const char*, const char*> planted[] = {
      {"mapping_core/service/a.cc", "<google/protobuf/message.h>"},
      {"mapping_core/store/a.h", "\"comap/v1/keyframe.pb.h\""},
      {"protocol/session/a.cc", "<fastdds/dds/domain/DomainParticipant.hpp>"},
      {"edge_agent/uplink/a.cc", "<fastrtps/types/TypesBase.h>"},
      {"mapping_core/tiles/a.cc", "<vulkan/vulkan.h>"},
      {"protocol/link/a.cc", "<openssl/evp.h>"},
      {"fleet_tools/a.cc", "\"volk.h\""},
      {"protocol/codec/a.cc", "\"mapping_core/ferns/fern_book.h\""},
      {"protocol/link/a.h", "\"edge_agent/agent.h\""},
      {"protocol/types/a.h", "\"protocol/codec/envelope.h\""},
      {"mapping_core/verify/a.cc", "\"edge_agent/odometry/visual_odometry.h\""},
      {"mapping_core/service/a.cc", "\"fleet_tools/command_line/verb.h\""},
      {"edge_agent/agent.cc", "\"mapping_core/surfels/surfel_map.h\""},
      {"edge_agent/agent.cc", "\"fleet_tools/command_line/verb.h\""},
      {"mapping_core/rgbd/a.h", "\"mapping_core/gpu/device.h\""},
      {"robot_api/a.cc", "\"protocol/codec/codec.h\""},
      {"robot_api/a.cc", "\"edge_agent/agent.h\""},
      {"robot_api/a.cc", "<google/protobuf/message.h>"},
      {"edge_agent/api/a.cc", "\"robot_api/connection.h\""},
      {"mapping_core/rgbd/a.h", "\"protocol/codec/envelope.h\""},
      {"mapping_core/ferns/a.h", "\"mapping_core/rgbd/pyramid.h\""},
      {"fleet_tools/a.cc", "\"tests/scenes/scene.h\""},
      {"mapping_core/graph/a.cc", "  <vulkan/vulkan.h>  // with a remark"},
  };
  for (const auto& [file, include] : planted)
    EXPECT_EQ(PlantedInclude(file, include).violations(), 1u) << file << " includes " << include;
}

TEST(IncludeRules, whatIsAllowedPasses) {
  const std::pair<const char*, const char*> fine[] = {
      {"protocol/codec/a.cc", "\"comap/v1/hello.pb.h\""},
      {"protocol/link/a.cc", "<fastdds/dds/domain/DomainParticipant.hpp>"},
      {"mapping_core/gpu/a.cc", "<vulkan/vulkan.h>"},
      {"mapping_core/verify/a.cc", "\"mapping_core/rgbd/alignment.h\""},
      {"mapping_core/ferns/a.cc", "\"protocol/types/keyframe.h\""},
      {"edge_agent/odometry/a.h", "\"mapping_core/rgbd/alignment.h\""},
      {"fleet_tools/a.cc", "\"edge_agent/agent.h\""},
      {"mapping_core/service/a.cc", "<vector>"},
  };
  for (const auto& [file, include] : fine)
    EXPECT_EQ(PlantedInclude(file, include).violations(), 0u) << file << " includes " << include;
}

}  // namespace
}  // namespace comap
