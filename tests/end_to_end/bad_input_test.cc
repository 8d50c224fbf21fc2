// What people get wrong: a clear error, the right exit code, nothing presented as whole that is not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "edge_agent/capture/image_file.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class BadInput : public FlatTest {
 protected:
  // A few frames of robot a that a test may damage.
  std::string copyOfA() {
    const std::string copy = folder_.path("a");
    fs::copy(flat_ + "/a", copy, fs::copy_options::recursive);
    return copy;
  }

  ProgramRun replay(const std::string& robots) {
    return runProgram("fleet replay --link loopback " + robots + " --out " + folder_.path("run"));
  }

  void expectNoRun() const {
    EXPECT_FALSE(fs::exists(folder_.path("run/report.json")));
    EXPECT_FALSE(fs::exists(folder_.path("run/map.ply")));
  }
};

TEST_F(BadInput, MissingFolder) {
  const ProgramRun run = replay("--robot a=" + folder_.path("nowhere"));
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("nowhere"));
  expectNoRun();
}

TEST_F(BadInput, AFailedStartDoesNotStandInTheWayOfTheNext) {
  EXPECT_EQ(replay("--device 99 --robot a=" + flat_ + "/a@0:5").exit_code, 3);
  EXPECT_EQ(replay("--robot a=" + flat_ + "/a@0:5").exit_code, 0);
}

TEST_F(BadInput, TruthForSomeRobotsGivesNoJointError) {
  ASSERT_EQ(replay("--robot a=" + flat_ + "/a@0:30 --robot b=" + flat_ + "/b@0:30").exit_code, 0);
  const ProgramRun run =
      runProgram("fleet evaluate " + folder_.path("run") + " --truth a=" + flat_ + "/a/groundtruth.txt");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("no truth given for robot b"));
}

TEST_F(BadInput, RobotWithoutFolderOrWithABadName) {
  EXPECT_EQ(replay("--robot a").exit_code, 2);
  const ProgramRun run = replay("--robot 'A b=" + flat_ + "/a'");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("A b"));
  expectNoRun();
}

TEST_F(BadInput, ALogIsToBeMadeAFolderFirst) {
  const ProgramRun run = replay("--robot a=klg:drive.klg@0:10");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("--source klg:drive.klg@0:10 --record DIR"));
  expectNoRun();
}

TEST_F(BadInput, TwoRobotsOfOneName) {
  const ProgramRun run = replay("--robot a=" + flat_ + "/a --robot a=" + flat_ + "/b");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("robot a"));
}

TEST_F(BadInput, UnreadableCalibration) {
  const std::string a = copyOfA();
  std::ofstream(a + "/calibration.txt") << "525 525 oops 239.5 640 480 5000\n";
  const ProgramRun run = replay("--robot a=" + a);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("calibration.txt"));
  EXPECT_THAT(run.err, HasSubstr("oops"));
  expectNoRun();
}

TEST_F(BadInput, EveryImageTruncated) {
  const std::string a = copyOfA();
  for (const auto& entry : fs::directory_iterator(a + "/rgb")) fs::resize_file(entry.path(), 300);
  const ProgramRun run = replay("--robot a=" + a);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("rgb/"));
  expectNoRun();
}

TEST_F(BadInput, OneTruncatedImageIsPassedOverAndCounted) {
  const std::string a = copyOfA();
  fs::resize_file(fs::directory_iterator(a + "/rgb")->path(), 300);
  const ProgramRun run = replay("--robot a=" + a + "@0:30");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(fs::exists(folder_.path("run/report.json")));
}

TEST_F(BadInput, ImagesOfAnotherSizeThanCalibrated) {
  const std::string a = copyOfA();
  for (const auto& entry : fs::directory_iterator(a + "/rgb"))
    ASSERT_TRUE(writeColourJpeg(entry.path().string(), ColourImage(320, 240), 90));
  const ProgramRun run = replay("--robot a=" + a);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("320"));
  expectNoRun();
}

TEST_F(BadInput, ARecordingOfWhichNothingCanBeUsedIsToldAsSuch) {
  const std::string a = copyOfA();
  for (const auto& entry : fs::directory_iterator(a + "/depth"))
    ASSERT_TRUE(writeDepth16Png(entry.path().string(), Image<uint16_t>(640, 480, 0)));
  const ProgramRun run = replay("--robot a=" + a + "@0:20");
  EXPECT_EQ(run.exit_code, 3) << run.out;
  EXPECT_THAT(run.err, HasSubstr("of 20 frames none can be used, 0 damaged and the others with too little depth"));
  EXPECT_THAT(run.out, HasSubstr("20 frames"));
  const ProgramRun agent =
      runProgram("edge_agent --offline --robot a --source tum:" + a + "@0:20 --outbox " + folder_.path("box"));
  EXPECT_EQ(agent.exit_code, 3) << agent.out;
  EXPECT_THAT(agent.err + agent.out, HasSubstr("of 20 frames none can be used, 0 are damaged"));
}

TEST_F(BadInput, WhatIsNotThereIsAnsweredWithWhatIs) {
  ASSERT_EQ(replay("--robot a=" + flat_ + "/a@0:60").exit_code, 0);
  const std::string render = "fleet render " + folder_.path("run/map.comap") + " --out " + folder_.path("x.png");
  for (const auto& [options, answer] : {std::pair(" --map nowhere", "holds no map 'nowhere', but a-1-0"),
                                        std::pair(" --view robot:b", "no keyframe of robot 'b', but of a"),
                                        std::pair(" --colour pink", "{rgb,normal,contribution,confidence}")}) {
    const ProgramRun run = runProgram(render + options);
    EXPECT_EQ(run.exit_code, 2) << options;
    EXPECT_THAT(run.err + run.out, HasSubstr(answer));
  }
}

TEST_F(BadInput, OutputThatCannotBeWrittenIsNoSuccess) {
  ASSERT_EQ(replay("--robot a=" + flat_ + "/a@0:20").exit_code, 0);
  const std::string store = folder_.path("run/map.comap"), said = folder_.path("said");
  for (const std::string& command :
       {std::string("fleet --help"), std::string("fleet --version"), std::string("fleet info --help"),
        "fleet info " + store, "fleet info --json " + store, "fleet matches " + store, "fleet matches --json " + store,
        "fleet merges " + store, "fleet doctor " + store, std::string("fleet completion bash"),
        std::string("mapping_core --print-config"), std::string("mapping_core --list-devices"),
        std::string("mapping_core --help"), std::string("edge_agent --print-config --robot a"),
        std::string("edge_agent --list-sources"), std::string("edge_agent --man")}) {
    EXPECT_EQ(runProgram(command).exit_code, 0) << command;
    EXPECT_EQ(runProgram(command + " >/dev/full 2>" + said + "; exit $?").exit_code, 3) << command;
    EXPECT_THAT(contentOf(said), HasSubstr(": cannot write all of its output")) << command;
  }
  EXPECT_EQ(runProgram("fleet info " + folder_.path("nowhere.comap") + " >/dev/full; exit $?").exit_code, 3);
  EXPECT_EQ(runProgram("fleet info --help | true").exit_code, 0) << "who has read enough may close a pipe";
}

TEST_F(BadInput, AnEmptyNameIsToldAsSuch) {
  for (const std::string command : {"fleet man ''", "fleet evaluate ''", "fleet info ''", "fleet view ''",
                                    "fleet recover x --out ''", "fleet render x --out ''"}) {
    const ProgramRun run = runProgram(command);
    EXPECT_EQ(run.exit_code, 2) << command;
    EXPECT_THAT(run.err + run.out, HasSubstr("its value is empty")) << command;
  }
}

TEST_F(BadInput, APictureIsNotNamedAsWhatItIsNot) {
  const ProgramRun run = runProgram("fleet render x.comap --out " + folder_.path("map.jpg"));
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("map.jpg: a PNG file is written, expected a name that ends in .png"));
}

TEST_F(BadInput, WatchingASiteWithoutACoreIsNoSuccess) {
  const ProgramRun run = runProgram("fleet watch --site nobody-is-here --domain 229 --for 1 --wait 60");
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("was heard within the 1 s of --for"));
}

TEST_F(BadInput, ADamagedStoreIsToldWithWhatToDo) {
  const std::string store = folder_.path("cut.comap");
  std::ofstream(store, std::ios::binary) << "SQLite format 3" << '\0' << std::string(5000, 'x');
  for (const std::string& verb :
       std::vector<std::string>{"info ", "matches ", "merges ", "finish ", "split --later ", "view --port 0 ",
                                "export --format ply --out " + folder_.path("o.ply") + " "}) {
    const ProgramRun run = runProgram("fleet " + verb + store + (verb.starts_with("split") ? " 1" : ""));
    EXPECT_EQ(run.exit_code, 3) << verb << run.err;
    EXPECT_THAT(run.err, HasSubstr("'fleet recover " + store + " --out NEW'")) << verb;
  }
}

TEST_F(BadInput, NoProgramWritesOverADatabase) {
  const std::string database = folder_.path("other.comap"), content = std::string("SQLite format 3\0and more", 24);
  const std::string agent =
      "edge_agent --robot a --offline --outbox " + folder_.path("box") + " --source tum:" + flat_ + "/a@0:5";
  const std::string core = "mapping_core --store " + folder_.path("new.comap");
  for (const std::string& command : {core + " --trace ", core + " --report ", agent + " --trace ", agent + " --report ",
                                     agent + " --preview ", agent + " --calibrate-check "}) {
    std::ofstream(database, std::ios::binary) << content;
    const ProgramRun run = runProgram(command + database);
    EXPECT_EQ(run.exit_code, 2) << command;
    EXPECT_THAT(run.err + run.out, HasSubstr("is a map store or another database")) << command;
    std::ifstream file(database, std::ios::binary);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), content) << command;
  }
}

TEST_F(BadInput, NoResultTakesThePlaceOfWhatWasRead) {
  const std::string config = folder_.path("mine.yaml"), content = "robot: a\n";
  const std::string agent = "edge_agent --offline --outbox " + folder_.path("box") + " --config " + config +
                            " --source tum:" + flat_ + "/a@0:5";
  for (const char* option : {" --preview ", " --report ", " --trace ", " --calibrate-check "}) {
    std::ofstream(config) << content;
    const ProgramRun run = runProgram(agent + option + config);
    EXPECT_EQ(run.exit_code, 2) << option;
    EXPECT_THAT(run.err, HasSubstr("mine.yaml: is there and is not")) << option;
    std::ifstream file(config);
    EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), content) << option;
  }
}

TEST_F(BadInput, AnEmptyValueIsNotNoOption) {
  for (const char* option : {"--preview", "--record", "--calibrate-check", "--config", "--source"}) {
    const ProgramRun run = runProgram(std::string("edge_agent --robot a --offline ") + option + " ''");
    EXPECT_EQ(run.exit_code, 2) << option;
    EXPECT_THAT(run.err + run.out, HasSubstr("empty")) << option;
  }
  EXPECT_EQ(runProgram("mapping_core --store ''").exit_code, 2);
  EXPECT_EQ(runProgram("edge_agent --source x --record " + folder_.path("r") + " --frames -5").exit_code, 2);
}

TEST_F(BadInput, OutputFolderThatIsNoRun) {
  fs::create_directories(folder_.path("run"));
  std::ofstream(folder_.path("run/thesis.txt")) << "precious";
  const ProgramRun run = replay("--robot a=" + flat_ + "/a@0:10 --overwrite");
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_TRUE(fs::exists(folder_.path("run/thesis.txt")));
}

TEST_F(BadInput, FolderThatOnlyLooksLikeARunIsNotEmptied) {
  fs::create_directories(folder_.path("run/logs"));
  std::ofstream(folder_.path("run/map.comap")) << "somebody else's";
  EXPECT_EQ(
      runProgram("fleet replay --link loopback --overwrite --robot a=" + flat_ + "/a@0:10 --out " + folder_.path("run"))
          .exit_code,
      2);
  EXPECT_TRUE(fs::exists(folder_.path("run/map.comap")));
}

TEST_F(BadInput, OptionsOfTheOtherModeAreRefused) {
  const std::string robot = " --robot a=" + flat_ + "/a@0:5";
  for (const char* options :
       {"--mode paper --link dds", "--alone", "--truth a=file", "--fix two-votes", "--mode paper --fix everything",
        "--compare --seeds 2", "--mode paper --realtime", "--compare --link dds", "--compare --mode paper",
        "--compare --mode graph", "--compare --truth b=file", "--compare --truth a=x --truth a=y"})
    EXPECT_EQ(runProgram(std::string("fleet replay ") + options + robot + " --out " + folder_.path("run")).exit_code, 2)
        << options;
}

TEST_F(BadInput, WhatAComparisonReadsAtItsEndIsReadBeforeItBegins) {
  const std::string robot = "fleet replay --compare --robot a=" + flat_ + "/a@0:5 --out " + folder_.path("run");
  std::ofstream(folder_.path("words.txt")) << "no truth\n";
  std::ofstream(folder_.path("empty.txt")).flush();
  const std::string words = folder_.path("words.txt");
  for (const auto& [options, code] : {std::pair(" --truth a=/nowhere.txt", 3), {" --surface /nowhere.ply", 3}}) {
    const ProgramRun run = runProgram(robot + options);
    EXPECT_EQ(run.exit_code, code) << options << ": " << run.err;
    EXPECT_THAT(run.err, HasSubstr("nowhere"));
  }
  for (const std::string& options :
       {" --truth a=" + words, " --truth a=" + folder_.path("empty.txt"), " --surface " + words}) {
    const ProgramRun run = runProgram(robot + options);
    EXPECT_EQ(run.exit_code, 3) << options << ": " << run.err;
    EXPECT_THAT(run.err, HasSubstr(".txt"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder_.path("run"))) << "nothing was begun";
  std::string many = "fleet replay --mode paper --out " + folder_.path("run");
  for (int i = 0; i < 9; ++i) many += " --robot r" + std::to_string(i) + "=" + flat_ + "/a@0:5";
  const ProgramRun run = runProgram(many);
  EXPECT_EQ(run.exit_code, 2) << run.err;
  EXPECT_THAT(run.err, HasSubstr("at most 8"));
}

TEST_F(BadInput, UnknownOptionAndVerb) {
  EXPECT_EQ(runProgram("fleet replay --roboot a=b").exit_code, 2);
  const ProgramRun unknown = runProgram("fleet dance");
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_NE(unknown.err.find("dance"), std::string::npos) << unknown.err;
  EXPECT_EQ(runProgram("edge_agent --sauce x").exit_code, 2);
  EXPECT_EQ(runProgram("mapping_core --domain 999").exit_code, 2);
}

TEST_F(BadInput, UnknownConfigKey) {
  std::ofstream(folder_.path("robot.yaml")) << "robot: a\nlink:\n  domian: 3\n";
  const ProgramRun robot = runProgram("edge_agent --check-config --config " + folder_.path("robot.yaml"));
  EXPECT_EQ(robot.exit_code, 2);
  EXPECT_THAT(robot.err, HasSubstr("robot.yaml:3"));
  EXPECT_THAT(robot.err, HasSubstr("domian"));
  std::ofstream(folder_.path("core.yaml")) << "matching:\n  votes: many\n";
  const ProgramRun core = runProgram("mapping_core --check-config --config " + folder_.path("core.yaml"));
  EXPECT_EQ(core.exit_code, 2);
  EXPECT_THAT(core.err, HasSubstr("votes"));
}

TEST_F(BadInput, RangesThatAreNone) {
  const auto refused = [&](const std::string& program, const std::string& text, const std::string& why) {
    std::ofstream(folder_.path("config.yaml")) << text;
    const ProgramRun run = runProgram(program + " --check-config --config " + folder_.path("config.yaml"));
    EXPECT_EQ(run.exit_code, 2) << text;
    EXPECT_THAT(run.err, HasSubstr(why));
  };
  refused("edge_agent", "odometry:\n  depth_min_m: 2\n  depth_max_m: 1\n",
          "config.yaml:3: odometry.depth_max_m: is 1, expected more than depth_min_m, 2");
  refused("edge_agent", "uplink:\n  jpeg_quality: 40\noutbox:\n  thin_jpeg_quality: 50\n",
          "config.yaml:4: outbox.thin_jpeg_quality: is 50, expected at most uplink.jpeg_quality, 40");
  refused("edge_agent", "camera:\n  colour:\n    cx: 9999\n", "config.yaml:3: camera.colour.cx: is '9999'");
  refused("mapping_core", "fusion:\n  depth_min_m: 1.5\n  depth_max_m: 1\n",
          "config.yaml:3: fusion.depth_max_m: is 1, expected more than depth_min_m, 1.5");
  refused("mapping_core", "fusion:\n  memory_mb: 16\n",
          "config.yaml:2: fusion.memory_mb: is 16, expected 0 (what the device gives) or 256 at least");
  refused("mapping_core", "device: nvidia\n",
          "config.yaml:1: device: is 'nvidia', expected auto, llvmpipe or a number from the list of devices");
}

TEST_F(BadInput, ShippedConfigsAreTheDefaults) {
  for (const auto& [program, file] : {std::pair("edge_agent", "robot.yaml"), std::pair("mapping_core", "core.yaml")}) {
    std::ifstream shipped(COMAP_SOURCE_DIR "/config/" + std::string(file));
    const std::string text((std::istreambuf_iterator<char>(shipped)), std::istreambuf_iterator<char>());
    EXPECT_EQ(text, runProgram(std::string(program) + " --print-config").out) << file;
  }
}

TEST_F(BadInput, PrintedConfigIsReadBack) {
  for (const std::string program : {"edge_agent", "mapping_core"}) {
    const ProgramRun printed = runProgram(program + " --print-config");
    ASSERT_EQ(printed.exit_code, 0);
    std::ofstream(folder_.path("printed.yaml")) << printed.out;
    const ProgramRun again = runProgram(program + " --print-config --config " + folder_.path("printed.yaml"));
    EXPECT_EQ(again.exit_code, 0) << again.err;
    EXPECT_EQ(again.out, printed.out);
  }
}

TEST_F(BadInput, NoVulkanDevice) {
  const std::string none = "VK_ICD_FILENAMES=/nonexistent.json VK_DRIVER_FILES=/nonexistent.json";
  const ProgramRun run =
      runProgram("fleet replay --link loopback --robot a=" + flat_ + "/a@0:5 --out " + folder_.path("run"), none);
  EXPECT_EQ(run.exit_code, 3);
  EXPECT_THAT(run.err, HasSubstr("Vulkan"));
  expectNoRun();
  EXPECT_EQ(runProgram("mapping_core --domain 93 --store " + folder_.path("m.comap"), none).exit_code, 3);
}

TEST_F(BadInput, DeviceThatIsNotThere) {
  const ProgramRun run = runProgram("mapping_core --device 99 --domain 94 --store " + folder_.path("m.comap"));
  EXPECT_NE(run.exit_code, 0);
  EXPECT_THAT(run.err, HasSubstr("99"));
}

TEST_F(BadInput, AgentWithoutACoreGivesUpInTime) {
  const ProgramRun run = runProgram("edge_agent --robot a --domain 231 --source tum:" + flat_ + "/a --patience 1");
  EXPECT_EQ(run.exit_code, 2);
  const ProgramRun alone = runProgram(
      "edge_agent --robot a --domain 99 --core-site nobody --outbox memory --source tum:" + flat_ + "/a --patience 1");
  EXPECT_EQ(alone.exit_code, 3);
  EXPECT_THAT(alone.err, HasSubstr("nobody"));
}

// None of them waits for a writer that never comes.
TEST_F(BadInput, APipeIsNoFileToRead) {
  const std::string pipe = folder_.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_directory(folder_.path("keys"));
  ASSERT_EQ(mkfifo(folder_.path("keys/authority.pem").c_str(), 0600), 0);
  fs::create_directory(folder_.path("tum"));
  for (const std::string name : {"rgb.txt", "depth.txt"})
    ASSERT_EQ(mkfifo(folder_.path("tum/" + name).c_str(), 0600), 0);
  const std::string robot = "edge_agent --robot a --offline --outbox " + folder_.path() + " --source ";
  for (const std::string& command : std::vector<std::string>{
           "edge_agent --check-config --config " + pipe, "mapping_core --check-config --config " + pipe,
           "edge_agent --check-config --robot a --keys " + folder_.path("keys"), robot + "klg:" + pipe,
           robot + "tum:" + folder_.path("tum"), robot + "tum:" + flat_ + "/a@0:3 --trace " + pipe,
           "mapping_core --store " + pipe, "fleet evaluate --trajectory " + pipe + " --truth " + pipe,
           "fleet info " + pipe, "fleet keys show " + folder_.path("keys")}) {
    const ProgramRun run = runProgram(command, "timeout 20");
    EXPECT_EQ(run.exit_code, 3) << command << "\n" << run.err;
    EXPECT_THAT(run.err, HasSubstr(folder_.path())) << command;
  }
}

TEST_F(BadInput, StoreThatIsNoStore) {
  std::ofstream(folder_.path("letter.txt")) << "Dear Sir or Madam";
  for (const std::string verb : {"info", "matches", "merges"}) {
    const ProgramRun run = runProgram("fleet " + verb + " " + folder_.path("letter.txt"));
    EXPECT_EQ(run.exit_code, 3) << verb;
    EXPECT_THAT(run.err, HasSubstr("letter.txt")) << verb;
  }
  EXPECT_EQ(runProgram("fleet info " + folder_.path("nothing.comap")).exit_code, 3);
  EXPECT_FALSE(fs::exists(folder_.path("nothing.comap")));
}

}  // namespace
}  // namespace comap
