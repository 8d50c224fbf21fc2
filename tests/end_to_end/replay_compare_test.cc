// Graph mode and paper mode on the same few frames, and a run of the paper mode that is not overwritten.
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using Json = nlohmann::json;

class Compare : public FlatTest {};

TEST_F(Compare, BothModesAreRunAndMeasured) {
  const std::string out = folder_.path("run");
  const ProgramRun run = runProgram("fleet replay --compare --json --robot a=" + flat_ + "/a@0:5 --robot b=" + flat_ +
                                    "/b@0:5 --out " + out);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json written = Json::parse(contentOf(out + "/compare.json"), nullptr, false);
  ASSERT_FALSE(written.is_discarded());
  EXPECT_EQ(Json::parse(run.out), written);
  ASSERT_EQ(written.at("inputs").size(), 1u);
  EXPECT_EQ(written.at("inputs")[0].at("name"), "a+b");
  for (const char* mode : {"graph", "paper"}) {
    const Json& row = written.at("inputs")[0].at(mode);
    EXPECT_EQ(row.at("frames"), 10) << mode;
    EXPECT_GT(row.at("uplink_bytes").get<double>(), 0) << mode;
    EXPECT_GE(row.at("maps").get<int>(), 1) << mode;
    for (const char* robot : {"a", "b"})
      EXPECT_LT(row.at("ate_rmse_m").at(robot).get<double>(), 0.02) << mode << ", the truth lies beside the frames";
    EXPECT_TRUE(std::filesystem::exists(out + "/" + mode + "/report.json")) << mode;
  }
  const std::string page = contentOf(out + "/compare.html");
  EXPECT_NE(page.find("<polyline"), std::string::npos) << "times of the rounds are drawn from frames.csv";
}

TEST_F(Compare, ARobotTooShortToMeasureIsAMissingCellAndNoError) {
  const std::string out = folder_.path("run");
  const ProgramRun run = runProgram("fleet replay --compare --json --robot a=" + flat_ + "/a@0:4 --robot b=" + flat_ +
                                    "/b@0:2 --out " + out);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json written = Json::parse(run.out, nullptr, false);
  ASSERT_FALSE(written.is_discarded()) << run.out;
  for (const char* mode : {"graph", "paper"}) {
    const Json& row = written.at("inputs")[0].at(mode);
    EXPECT_TRUE(row.at("ate_rmse_m").at("b").is_null()) << mode;
    EXPECT_TRUE(row.at("ate_reason").contains("b")) << mode;
    EXPECT_TRUE(row.at("ate_rmse_m").at("a").is_number()) << mode;
  }
  const Json& notes = written.at("notes");
  EXPECT_EQ(std::count_if(notes.begin(), notes.end(),
                          [](const Json& note) { return note.get<std::string>().starts_with("a+b, ATE of b, "); }),
            2)
      << notes.dump();
}

TEST_F(Compare, AnAblationHasEachRemedyByItselfAndAll) {
  const std::string out = folder_.path("run");
  const std::string command = "fleet replay --compare --ablation --json --robot a=" + flat_ + "/a@0:2 --out " + out;
  const ProgramRun both = runProgram(command + " --fix two-votes");
  EXPECT_EQ(both.exit_code, 2) << both.err;
  const ProgramRun run = runProgram(command);
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const Json written = Json::parse(run.out, nullptr, false);
  ASSERT_FALSE(written.is_discarded()) << run.out;
  const Json& remedies = written.at("inputs")[0].at("remedies");
  ASSERT_EQ(remedies.size(), 10u);
  for (const Json& remedy : remedies) {
    const std::string name = remedy.at("name").get<std::string>();
    const Json report = Json::parse(contentOf(out + "/fix-" + name + "/report.json"), nullptr, false);
    ASSERT_FALSE(report.is_discarded()) << name;
    for (const auto& [fix, on] : report.at("fixes").items()) {
      std::string option = fix;
      std::replace(option.begin(), option.end(), '_', '-');
      EXPECT_EQ(on.get<bool>(), name == option || (name == "all" && option != "joint-covariance"))
          << name << ": " << fix;
    }
  }
}

TEST_F(Compare, ARunOfThePaperModeIsNotOverwrittenUnasked) {
  const std::string command = "fleet replay --mode paper --robot a=" + flat_ + "/a@0:2 --out " + folder_.path("run");
  const ProgramRun first = runProgram(command);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  const std::string report = contentOf(folder_.path("run") + "/report.json");
  const ProgramRun again = runProgram(command);
  EXPECT_EQ(again.exit_code, 2) << again.err;
  EXPECT_NE(again.err.find("--overwrite"), std::string::npos) << again.err;
  EXPECT_EQ(contentOf(folder_.path("run") + "/report.json"), report);
  EXPECT_EQ(runProgram(command + " --overwrite").exit_code, 0);
}

}  // namespace
}  // namespace comap
