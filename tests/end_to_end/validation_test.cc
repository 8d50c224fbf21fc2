// Programs as people run them, watched by Vulkan's validation layer: it prints what it finds where nobody listens.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/end_to_end/program.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr const char* kWatched = "VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation VK_LOADER_DEBUG=layer";

// Skips if the layer is not there to be loaded.
void expectNothingToSay(const std::string& command) {
  SCOPED_TRACE(command);
  const ProgramRun run = runProgram(command, kWatched);
  EXPECT_EQ(run.exit_code, 0) << run.err;
  if (run.err.find("Insert instance layer \"VK_LAYER_KHRONOS_validation\"") == std::string::npos)
    GTEST_SKIP() << "the validation layer was not loaded";
  for (const char* word : {"VUID-", "Validation Error", "Validation Warning", "UNASSIGNED-"}) {
    EXPECT_THAT(run.out, Not(HasSubstr(word)));
    EXPECT_THAT(run.err, Not(HasSubstr(word)));
  }
}

TEST(Validation, HasNothingToSayOfProgramsThatUseADevice) {
  const char* flat = std::getenv("COMAP_FLAT_DIR");
  if (flat == nullptr) GTEST_SKIP() << "COMAP_FLAT_DIR names no synthetic flat; run by ctest, which makes one";
  const TemporaryFolder folder;
  const std::string robots = " --robot a=" + std::string(flat) + "/a@0:40 --robot b=" + flat + "/b@0:40 --out ";
  expectNothingToSay("fleet replay --link loopback" + robots + folder.path("graph"));
  expectNothingToSay("fleet render " + folder.path("graph") + "/map.comap --out " + folder.path("picture.png"));
  expectNothingToSay("fleet replay --mode paper" + robots + folder.path("paper"));
  expectNothingToSay("mapping_core --list-devices");
}

}  // namespace
}  // namespace comap
