#include "fleet_tools/evaluate/evaluate.h"

#include <gtest/gtest.h>

#include "fleet_tools/evaluate/errors_csv.h"
#include "fleet_tools/report/run_page.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using nlohmann::json;

// Six positions of a symmetric cross around (5, 0, 0), moved by `x`.
std::string crossAt(double x) {
  const double arms[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  std::string text;
  for (int i = 0; i < 6; ++i) {
    text += std::to_string(i) + " " + std::to_string(5 + x + arms[i][0]) + " " + std::to_string(arms[i][1]) + " " +
            std::to_string(arms[i][2]) + " 0 0 0 1\n";
  }
  return text;
}

// Two robots that are right by themselves, and b 0.4 m off from a in the joint map.
class EvaluateTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_.write("truth.txt", crossAt(0));
    folder_.write("run/a.trajectory.txt", crossAt(0));
    folder_.write("run/b.trajectory.txt", crossAt(0.4));
    writeReport(R"({"robots":{"a":{"frames":6,"map":"a/1/0"},"b":{"frames":6,"map":"a/1/0"}},"wall_s":3.5})");
    truth_.trajectories = {{"a", folder_ / "truth.txt"}, {"b", folder_ / "truth.txt"}};
  }
  void writeReport(const std::string& text) { folder_.write("run/report.json", text); }
  Result<RunEvaluation> evaluate() { return evaluateRun(folder_ / "run", truth_, 2); }

  TemporaryFolder folder_;
  RunTruth truth_;
};

TEST_F(EvaluateTest, OneMapGetsAJointError) {
  auto evaluation = evaluate();
  ASSERT_TRUE(evaluation) << evaluation.error().text;
  EXPECT_NEAR(evaluation->robots["a"].own.ate.rmse_m, 0, 1e-6);
  EXPECT_NEAR(evaluation->robots["b"].own.ate.rmse_m, 0, 1e-6);
  ASSERT_TRUE(evaluation->joint);
  EXPECT_NEAR(evaluation->joint->rmse_m, 0.2, 1e-6);
  EXPECT_NEAR(*evaluation->robots["b"].joint_rmse_m, 0.2, 1e-6);
}

TEST_F(EvaluateTest, ARobotTooShortToMeasureIsRefusedUnlessItIsToBeSpared) {
  folder_.write("run/b.trajectory.txt", "0.0 0 0 0 0 0 0 1\n");
  const auto refused = evaluate();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kProblem);
  truth_.spare_short = true;
  for (const char* trajectory : {"0.0 0 0 0 0 0 0 1\n", ""}) {
    folder_.write("run/b.trajectory.txt", trajectory);
    auto evaluation = evaluate();
    ASSERT_TRUE(evaluation) << evaluation.error().text;
    EXPECT_FALSE(evaluation->robots["b"].own_reason.empty());
    EXPECT_NEAR(evaluation->robots["a"].own.ate.rmse_m, 0, 1e-6);
    const auto report = updateReport(folder_ / "run", *evaluation);
    ASSERT_TRUE(report) << report.error().text;
    EXPECT_TRUE(report->at("robots").at("b").at("ate_rmse_m").is_null());
    EXPECT_EQ(report->at("robots").at("b").at("ate_reason"), evaluation->robots["b"].own_reason);
    EXPECT_FALSE(report->at("robots").at("a").contains("ate_reason"));
  }
  folder_.write("run/b.trajectory.txt", "not a pose\n");
  EXPECT_FALSE(evaluate()) << "what is damaged is no short trajectory";
}

TEST_F(EvaluateTest, SeveralMapsGetNoneAndSayWhy) {
  writeReport(R"({"robots":{"a":{"map":"a/1/0"},"b":{"map":"b/2/0"}}})");
  auto evaluation = evaluate();
  ASSERT_TRUE(evaluation) << evaluation.error().text;
  EXPECT_FALSE(evaluation->joint);
  EXPECT_NE(evaluation->joint_reason.find("b in b/2/0"), std::string::npos) << evaluation->joint_reason;
  auto report = updateReport(folder_ / "run", *evaluation);
  ASSERT_TRUE(report) << report.error().text;
  EXPECT_TRUE((*report)["joint_ate_rmse_m"].is_null());
  EXPECT_FALSE((*report)["joint_ate_reason"].get<std::string>().empty());
}

TEST_F(EvaluateTest, TheReportKeepsWhatItHadAndGainsTheNumbers) {
  folder_.write("truth.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                "property float nx\nproperty float ny\nproperty float nz\nend_header\n5 0 0 0 0 1\n");
  // Joint alignment moves the map by -0.2 along x; the point then lies 5 mm above the truth's.
  folder_.write("run/map.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
                "end_header\n5.2 0 0.005\n");
  truth_.surface = folder_ / "truth.ply";
  auto evaluation = evaluate();
  ASSERT_TRUE(evaluation) << evaluation.error().text;
  ASSERT_TRUE(updateReport(folder_ / "run", *evaluation));
  const json report = json::parse(folder_.read("run/report.json"));
  EXPECT_EQ(report["wall_s"], 3.5);
  EXPECT_EQ(report["robots"]["b"]["frames"], 6);
  EXPECT_NEAR(report["robots"]["b"]["ate_rmse_m"].get<double>(), 0, 1e-6);
  EXPECT_NEAR(report["joint_ate_rmse_m"].get<double>(), 0.2, 1e-6);
  EXPECT_NEAR(report["surface"]["accuracy_mean_m"].get<double>(), 0.005, 1e-6);
  EXPECT_NEAR(report["surface"]["accuracy_median_m"].get<double>(), 0.005, 1e-6);
  EXPECT_EQ(report["surface"]["completeness_2cm"], 1.0);
}

TEST_F(EvaluateTest, EachPosesErrorIsWrittenUnderTheJointAlignment) {
  auto evaluation = evaluate();
  ASSERT_TRUE(evaluation) << evaluation.error().text;
  ASSERT_TRUE(updateReport(folder_ / "run", *evaluation));
  const auto errors = readErrorsCsv(folder_ / "run/errors.csv");
  ASSERT_TRUE(errors) << errors.error().text;
  ASSERT_EQ(errors->size(), 2u);
  ASSERT_EQ(errors->at("b").size(), 6u);
  for (const PoseError& pose : errors->at("b")) EXPECT_NEAR(pose.error_m, 0.2, 1e-6);
  EXPECT_EQ(errors->at("a")[3].stamp_ns, 3'000'000'000);
  EXPECT_NEAR(errors->at("a")[0].true_position_m.x(), 6.2, 1e-5) << "in the map's frame, 0.2 m from the truth's";
}

TEST_F(EvaluateTest, ABadFileOfErrorsIsRefusedWithItsLine) {
  const std::string path = folder_ / "errors.csv", head = "robot,stamp_ns,error_m,true_x_m,true_y_m,true_z_m\n";
  for (const char* bad :
       {"a,1,2,3,4", "a,x,0,0,0,0", "a,1,nan,0,0,0", "a,1,0,0,0,0x", ",1,0,0,0,0", "../a,1,0,0,0,0"}) {
    folder_.write("errors.csv", head + "a,0,0,0,0,0\n" + bad + "\n");
    const auto errors = readErrorsCsv(path);
    ASSERT_FALSE(errors) << bad;
    EXPECT_EQ(errors.error().code, ErrorCode::kBadData);
    EXPECT_NE(errors.error().text.find(path + ": line 3"), std::string::npos) << errors.error().text;
  }
  EXPECT_EQ(readErrorsCsv(folder_ / "none.csv").error().code, ErrorCode::kUnreachable);
}

TEST_F(EvaluateTest, ThePageOfARunGainsWhatWasMeasured) {
  const std::string run = folder_ / "run";
  ASSERT_TRUE(writeRunPage(run));
  const std::string before = folder_.read("run/report.html");
  EXPECT_NE(before.find("Trajectories from above"), std::string::npos);
  EXPECT_EQ(before.find("Error over time"), std::string::npos);
  auto evaluation = evaluate();
  ASSERT_TRUE(evaluation) << evaluation.error().text;
  ASSERT_TRUE(updateReport(run, *evaluation));
  ASSERT_TRUE(writeRunPage(run));
  const std::string after = folder_.read("run/report.html");
  EXPECT_NE(after.find("Error over time, all robots aligned together"), std::string::npos);
  EXPECT_NE(after.find("200.0 mm"), std::string::npos) << "the joint error";
  EXPECT_NE(after.find("class=\"truth\""), std::string::npos);
}

TEST_F(EvaluateTest, ARobotWithoutAnyPoseIsNotDrawn) {
  folder_.write("run/b.trajectory.txt", "");
  const auto written = writeRunPage(folder_ / "run");
  ASSERT_TRUE(written) << written.error().text;
  EXPECT_NE(folder_.read("run/report.html").find("<title>a</title>"), std::string::npos);
  EXPECT_EQ(folder_.read("run/report.html").find("<title>b</title>"), std::string::npos);
}

TEST_F(EvaluateTest, EvaluatesOnlyWhatTheTrajectoryHolds) {
  const std::string all = crossAt(0);
  folder_.write("run/a.trajectory.txt", all.substr(0, all.find("4 ")));
  truth_.trajectories.erase("b");
  auto evaluation = evaluate();
  ASSERT_TRUE(evaluation) << evaluation.error().text;
  EXPECT_EQ(evaluation->robots["a"].own.ate.pairs, 4u);
}

TEST_F(EvaluateTest, BadInputsAreRefused) {
  const auto expect = [&](ErrorCode code, const char* word) {
    auto evaluation = evaluate();
    ASSERT_FALSE(evaluation) << word;
    EXPECT_EQ(evaluation.error().code, code) << evaluation.error().text;
    EXPECT_NE(evaluation.error().text.find(word), std::string::npos) << evaluation.error().text;
  };
  writeReport("{\"robots\":");
  expect(ErrorCode::kBadData, "report.json: is not a JSON object");
  writeReport("[1]");
  expect(ErrorCode::kBadData, "is not a JSON object");
  writeReport("{\"robots\":7}");
  expect(ErrorCode::kBadData, "no object 'robots'");
  writeReport("{\"robots\":{\"a\":1}}");
  expect(ErrorCode::kBadData, "robots.a");
  writeReport("{\"robots\":{\"a\":{}}}");
  expect(ErrorCode::kWrongUse, "no robot 'b'");
  std::filesystem::remove(folder_ / "run/report.json");
  expect(ErrorCode::kUnreachable, "report.json");
  SetUp();
  std::filesystem::remove(folder_ / "run/b.trajectory.txt");
  expect(ErrorCode::kUnreachable, "b.trajectory.txt");
  SetUp();
  folder_.write("truth.txt", "100 0 0 0 0 0 0 1\n101 0 0 0 0 0 0 1\n");
  expect(ErrorCode::kProblem, "only 0 of 6 poses");
  SetUp();
  truth_.surface = folder_ / "none.ply";
  expect(ErrorCode::kUnreachable, "none.ply");
  truth_.surface.clear();
  truth_.trajectories = {{"../a", folder_ / "truth.txt"}};
  expect(ErrorCode::kWrongUse, "../a");
}

}  // namespace
}  // namespace comap
