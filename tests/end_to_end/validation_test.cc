// Programs as people run them, watched by Vulkan's validation layer: it prints what it finds where nobody listens.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "tests/end_to_end/program.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using testing::HasSubstr;
using testing::Not;

// Runs a program with the layer, which prints warnings, too; `further`: more of the environment.
ProgramRun runWatched(const std::string& command, const TemporaryFolder& folder, const std::string& further = "") {
  const std::string settings = folder.path("vk_layer_settings.txt");
  std::ofstream(settings) << "khronos_validation.report_flags = error,warn,perf\n";
  return runProgram(command, "VK_INSTANCE_LAYERS=VK_LAYER_KHRONOS_validation VK_LOADER_DEBUG=layer " +
                                 ("VK_LAYER_SETTINGS_PATH=" + settings + " " + further));
}

bool isLoaded(const ProgramRun& run) {
  return run.err.find("Insert instance layer \"VK_LAYER_KHRONOS_validation\"") != std::string::npos;
}

TEST(Validation, HasNothingToSayOfProgramsThatUseADevice) {
  const char* flat = std::getenv("COMAP_FLAT_DIR");
  if (flat == nullptr) GTEST_SKIP() << "COMAP_FLAT_DIR names no synthetic flat; run by ctest, which makes one";
  const TemporaryFolder folder;
  if (!isLoaded(runWatched("mapping_core --list-devices", folder))) GTEST_SKIP() << "there is no validation layer";
  const std::string robots = " --robot a=" + std::string(flat) + "/a@0:40 --robot b=" + flat + "/b@0:40 --out ";
  const std::string render = "fleet render " + folder.path("graph/map.comap") + " --out " + folder.path("picture.png");
  for (const std::string& command : {"fleet replay --link loopback" + robots + folder.path("graph"), render,
                                     "fleet replay --mode paper" + robots + folder.path("paper")}) {
    SCOPED_TRACE(command);
    const ProgramRun run =
        runWatched(command, folder, "VK_LAYER_ENABLES=VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_TRUE(isLoaded(run));
    for (const char* word : {"VUID-", "Validation Error", "Validation Warning", "UNASSIGNED-", "SYNC-HAZARD"}) {
      EXPECT_THAT(run.out, Not(HasSubstr(word)));
      EXPECT_THAT(run.err, Not(HasSubstr(word)));
    }
  }
  // What it says would be heard: of good practice it has something to say.
  const ProgramRun heard =
      runWatched(render, folder, "VK_LAYER_ENABLES=VK_VALIDATION_FEATURE_ENABLE_BEST_PRACTICES_EXT");
  EXPECT_THAT(heard.out, HasSubstr("UNASSIGNED-BestPractices"));
}

}  // namespace
}  // namespace comap
