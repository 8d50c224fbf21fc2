// Several runs in one folder that are interrupted: nothing goes on behind the back of who interrupted them, and the
// same command goes on with what is finished.
#include <chrono>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

bool within(std::chrono::seconds patience, const std::function<bool()>& happens) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!happens())
    if (std::chrono::steady_clock::now() > deadline)
      return false;
    else
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
  return true;
}

// Programs whose command line has a word with this in it.
size_t programsWith(const std::string& text) {
  size_t count = 0;
  std::error_code gone;
  for (const auto& entry : fs::directory_iterator("/proc", gone))
    if (fs::exists(entry.path() / "cmdline", gone))
      count += contentOf((entry.path() / "cmdline").string()).find(text) != std::string::npos;
  return count;
}

class ReplaySeries : public FlatTest {
 protected:
  // Begins a command in the background, and interrupts it as a terminal does, when `when` has happened.
  void interruptWhen(std::vector<std::string> arguments, const std::function<bool()>& when) {
    const std::string log = folder_.path("interrupted.log");
    Background run("fleet", arguments, log);
    ASSERT_TRUE(within(std::chrono::seconds(300), [&] { return when() || !run.runs(); }));
    EXPECT_EQ(run.end(SIGINT), 128 + SIGINT) << contentOf(log);
    EXPECT_NE(contentOf(log).find("fleet: interrupted: the finished runs in " + out_ +
                                  " are kept; the same command goes on with the others\n"),
              std::string::npos)
        << contentOf(log);
  }
  static std::string commandOf(const std::vector<std::string>& arguments) {
    std::string command = "fleet";
    for (const std::string& word : arguments) command += " " + word;
    return command;
  }

  const std::string out_ = folder_.path("run");
};

TEST_F(ReplaySeries, AComparisonGoesOnWhereItWasInterrupted) {
  const std::vector<std::string> command = {"replay",  "--compare",
                                            "--alone", "--json",
                                            "--robot", "a=" + flat_ + "/a@0:5",
                                            "--robot", "b=" + flat_ + "/b@0:5",
                                            "--out",   out_};
  const std::string finished = out_ + "/alone-a/graph/report.json";
  interruptWhen(command, [&] { return fs::exists(out_ + "/alone-a/graph/.comap-finished"); });
  EXPECT_FALSE(fs::exists(out_ + "/compare.json"));
  const auto written = fs::last_write_time(finished);

  std::vector<std::string> other = command;
  other[5] = "a=" + flat_ + "/a@0:4";
  const ProgramRun refused = runProgram(commandOf(other));
  EXPECT_EQ(refused.exit_code, 2) << refused.err;
  EXPECT_NE(refused.err.find("holds runs of another command (robots"), std::string::npos) << refused.err;

  const ProgramRun rest = runProgram(commandOf(command));
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_NE(rest.err.find("finished before"), std::string::npos) << rest.err;
  EXPECT_EQ(fs::last_write_time(finished), written) << "it was run again";
  const Json comparison = Json::parse(rest.out, nullptr, false);
  ASSERT_FALSE(comparison.is_discarded()) << rest.out;
  ASSERT_EQ(comparison.at("inputs").size(), 3u);
  for (const Json& input : comparison.at("inputs"))
    for (const char* mode : {"graph", "paper"})
      EXPECT_TRUE(input.at(mode).at("ate_rmse_m").begin()->is_number()) << input.at("name") << " " << mode;

  // Nothing is left to do: the same answer, from the same runs.
  const ProgramRun again = runProgram(commandOf(command));
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_EQ(Json::parse(again.out, nullptr, false), comparison);
}

TEST_F(ReplaySeries, SeedsGoOnAndNoProgramIsLeftBehind) {
  const std::vector<std::string> command = {
      "replay", "--seeds", "2", "--link", "dds", "--robot", "a=" + flat_ + "/a@0:10", "--out", out_};
  interruptWhen(command, [&] { return fs::exists(out_ + "/seed-2/logs/core.log"); });
  EXPECT_TRUE(within(std::chrono::seconds(5), [&] { return programsWith(out_) == 0; })) << "it would write on";
  const auto written = fs::last_write_time(out_ + "/seed-1/report.json");
  const ProgramRun rest = runProgram(commandOf(command));
  ASSERT_EQ(rest.exit_code, 0) << rest.err;
  EXPECT_NE(rest.err.find("1 run was finished before"), std::string::npos) << rest.err;
  EXPECT_EQ(fs::last_write_time(out_ + "/seed-1/report.json"), written);
  for (const char* seed : {"/seed-1", "/seed-2"}) {
    EXPECT_TRUE(fs::exists(out_ + seed + "/report.html")) << seed;
    EXPECT_NE(rest.out.find("run: " + out_ + seed), std::string::npos) << rest.out;
  }
}

}  // namespace
}  // namespace comap
