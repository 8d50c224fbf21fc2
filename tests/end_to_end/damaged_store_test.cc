// A store that a disk has damaged: named, saved, and its map made anew.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;

class DamagedStore : public FlatTest {
 protected:
  Json run(const std::string& command, int exit_code = 0) {
    const ProgramRun done = runProgram(command);
    EXPECT_EQ(done.exit_code, exit_code) << command << ": " << done.err;
    return done.out.empty() ? Json() : Json::parse(done.out);
  }
};

TEST_F(DamagedStore, IsNamedAndSaved) {
  const Json report =
      run("fleet replay --json --link loopback --robot a=" + flat_ + "/a@0:50 --out " + folder_.path("run"));
  ASSERT_FALSE(report.is_null());
  const size_t keyframes = report.at("maps")[0].at("keyframes").get<size_t>();
  ASSERT_GE(keyframes, 5u);
  const std::string store = folder_.path("run/map.comap");
  EXPECT_TRUE(run("fleet doctor --json " + store).at("whole").get<bool>());

  // Undamaged, the new store has the map of the old one, to the bit.
  const Json same = run("fleet recover --json " + store + " --out " + folder_.path("same.comap"));
  ASSERT_EQ(same.at("maps").size(), 1u);
  EXPECT_EQ(same.at("maps")[0].at("hash"), report.at("maps")[0].at("hash"));

  // A part of the last keyframe's message becomes something else, within one page.
  const std::string content = contentOf(store);
  const size_t images = content.rfind("\xff\xd8\xff");  // where the last JPEG begins
  ASSERT_NE(images, std::string::npos);
  std::string damaged = content;
  const size_t at = (images + 100) % 4096 < 4000 ? images + 100 : images + 300;
  damaged.replace(at, 90, 90, 'x');
  std::ofstream(store, std::ios::binary) << damaged;
  const Json sick = run("fleet doctor --json " + store, 1);
  EXPECT_FALSE(sick.at("whole").get<bool>());
  EXPECT_EQ(sick.at("lost_keyframes"), 1);
  EXPECT_NE(sick.at("damage").dump().find("its message is damaged (checksum)"), std::string::npos) << sick.dump(2);

  const ProgramRun core = runProgram("mapping_core --domain 91 --core-site damaged --store " + store, "timeout 60");
  EXPECT_EQ(core.exit_code, 3) << core.err;
  EXPECT_NE(core.err.find("'fleet doctor " + store + "' names what is damaged"), std::string::npos) << core.err;
  EXPECT_NE(core.err.find("'fleet recover " + store + " --out NEW'"), std::string::npos) << core.err;

  const std::string saved = folder_.path("saved.comap");
  const Json rest = run("fleet recover --json " + store + " --out " + saved);
  EXPECT_EQ(rest.at("keyframes").get<size_t>(), keyframes - 1);
  size_t mapped = 0;
  for (const Json& map : rest.at("maps")) mapped += map.at("keyframes").get<size_t>();
  EXPECT_EQ(mapped, keyframes - 1);
  const Json healthy = run("fleet doctor --json " + saved);
  EXPECT_TRUE(healthy.at("whole").get<bool>()) << healthy.dump(2);
  EXPECT_GT(healthy.at("tiles").get<int>(), 5);
  EXPECT_EQ(runProgram("fleet recover " + store + " --out " + saved).exit_code, 2) << "it is there already";

  // Killed at any time, it leaves nothing under the new name, or all that could be saved.
  for (const int ms : {100, 200, 300, 450}) {
    const std::string late = folder_.path("late-" + std::to_string(ms) + ".comap");
    Background killed("fleet", {"recover", store, "--out", late}, folder_.path("killed.log"));
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
    killed.end(SIGKILL);
    const bool there = std::filesystem::exists(late);
    EXPECT_EQ(there ? run("fleet info --json " + late).at("keyframes").get<size_t>() : keyframes - 1, keyframes - 1)
        << ms;
  }
  const std::string again = folder_.path("again.comap");
  std::ofstream(again + ".part") << std::string(5000, '\0');  // as a killed one leaves it
  run("fleet recover --json " + store + " --out " + again);
  EXPECT_FALSE(std::filesystem::exists(again + ".part"));
  EXPECT_EQ(run("fleet info --json " + again).at("keyframes").get<size_t>(), keyframes - 1);
}

// Only one of several makes the new store, and the others say why they do not.
TEST_F(DamagedStore, IsSavedOnceWhoeverAsks) {
  run("fleet replay --json --link loopback --robot a=" + flat_ + "/a@0:20 --out " + folder_.path("run"));
  const std::string store = folder_.path("run/map.comap"), second = folder_.path("second.comap");
  std::filesystem::copy_file(store, second);
  const std::string saved = folder_.path("saved.comap"), draft = saved + ".part-lock";
  {
    std::ofstream mine(draft);
    const int file = open(draft.c_str(), O_RDWR);
    ASSERT_EQ(flock(file, LOCK_EX), 0);
    const ProgramRun refused = runProgram("fleet recover " + second + " --later --out " + saved);
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_NE(refused.err.find("another fleet recover is making it"), std::string::npos) << refused.err;
    close(file);
  }
  {
    std::vector<std::unique_ptr<Background>> several;
    for (int i = 0; i < 4; ++i)
      several.push_back(std::make_unique<Background>(
          "fleet", std::vector<std::string>{"recover", i % 2 == 0 ? store : second, "--later", "--out", saved},
          folder_.path("log" + std::to_string(i))));
    int made = 0;
    for (auto& one : several) made += one->wait() == 0;
    EXPECT_EQ(made, 1);
  }
  EXPECT_TRUE(run("fleet doctor --json " + saved).at("whole").get<bool>());
  EXPECT_FALSE(std::filesystem::exists(saved + ".part"));
  EXPECT_FALSE(std::filesystem::exists(draft));

  const ProgramRun nowhere = runProgram("fleet recover " + store + " --later --out " + folder_.path("no/new.comap"));
  EXPECT_EQ(nowhere.exit_code, 3);
  EXPECT_NE(nowhere.err.find("/no does not exist"), std::string::npos) << nowhere.err;
}

}  // namespace
}  // namespace comap
