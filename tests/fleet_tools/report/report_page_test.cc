#include "fleet_tools/report/report_page.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <regex>
#include <set>

#include "fleet_tools/report/html.h"

namespace comap {
namespace {

using nlohmann::json;

json fullReport() {
  json report;
  for (const char* name : {"alpha", "bravo"}) {
    report["robots"][name] = {{"frames", 900},
                              {"keyframes", 84},
                              {"keyframes_lost", 0},
                              {"uplink_bytes", 12345678},
                              {"uplink_bytes_per_s", 141000.5},
                              {"tracking_lost_frames", 3},
                              {"odometry_ms", {{"median", 9.5}, {"p95", 12.25}}},
                              {"ate_rmse_m", 0.0123},
                              {"map", "alpha-5-0"}};
  }
  report["maps"] = {
      {{"id", "alpha-5-0"}, {"robots", {"alpha", "bravo"}}, {"keyframes", 168}, {"surfels", 812345}, {"tiles", 310}}};
  report["merges"] = {{{"number", 1},
                       {"kept", "alpha-5-0"},
                       {"absorbed", "bravo-9-0"},
                       {"robots", {"alpha", "bravo"}},
                       {"voters", {"bravo/9/31", "bravo/9/44"}},
                       {"keyframes_ingested", 75}}};
  report["merges"].push_back({{"number", 2}, {"robots", {"alpha"}}, {"keyframes_ingested", 90}, {"undone", "no"}});
  report["timeline"] = {
      {"unit", "keyframe"},
      {"robots", {{"alpha", {{"first", 0}, {"last", 160}}}, {"bravo", {{"first", 5}, {"last", 167}}}}}};
  report["robots"]["alpha"]["colour"] = 1;
  report["robots"]["bravo"]["colour"] = 0;
  report["closures"] = {{"accepted", 31}, {"right", 31}, {"precision", 1.0}, {"false_merges", 0}};
  report["verdicts"] = {{"accepted", 42}, {"refused", {{"inlier_ratio", 17}, {"degenerate", 5}, {"round_trip", 9}}}};
  report["core"] = {{"keyframe_ms", {{"median", 210.0}, {"p95", 380.0}}}, {"device", "llvmpipe"}, {"peak_rss_mb", 640}};
  report["joint_ate_rmse_m"] = 0.0187;
  report["surface"] = {{"accuracy_mean_m", 0.0041},
                       {"accuracy_median_m", 0.003},
                       {"completeness_2cm", 0.31},
                       {"completeness_seen_2cm", 0.913}};
  report["wall_s"] = 88.4;
  report["parameters_hash"] = "9f86d081884c7d65";
  report["version"] = "0.1.0";
  report["parameters"] = {{"fusion", {{"depth_max_m", 5.0}}}, {"seed", 1}};
  return report;
}

std::vector<ReportTrajectory> circles() {
  std::vector<ReportTrajectory> result = {{"alpha", {}, "m", 1}, {"bravo", {}, "m", 0}};
  for (int i = 0; i < 700; ++i) {
    const double a = i * 0.01;
    result[0].positions.push_back({2 * std::cos(a), 0.1 * std::sin(5 * a), 1.5 * std::sin(a)});
    result[1].positions.push_back({1 + std::cos(a), 0, 0.3 * a - std::sin(2 * a)});
    for (ReportTrajectory& robot : result) {
      robot.truth.push_back(robot.positions.back() + Eigen::Vector3d(0.02, 0, 0.01 * a));
      robot.errors.push_back({1e9 + i / 30.0, 0.001 * (2 + std::sin(a))});
    }
  }
  return result;
}

// Every tag is closed in order. Enough of a check for the page's own small HTML.
void expectBalanced(const std::string& page) {
  static const std::set<std::string> kVoid = {"meta", "img", "!doctype"};
  std::vector<std::string> open;
  const std::string body = std::regex_replace(page, std::regex("<style>[^<]*</style>"), "");
  const std::regex tag("<(/?)([A-Za-z!][A-Za-z0-9]*)((?:[^<>\"]|\"[^\"]*\")*?)(/?)>");
  size_t matched = 0;
  for (std::sregex_iterator at(body.begin(), body.end(), tag), end; at != end; ++at) {
    ++matched;
    std::string name = (*at)[2];
    for (char& c : name) c = char(std::tolower(c));
    if (kVoid.contains(name) || (*at)[4] == "/") continue;
    if ((*at)[1] != "/") {
      open.push_back(name);
      continue;
    }
    ASSERT_FALSE(open.empty()) << "closes nothing: " << name;
    ASSERT_EQ(open.back(), name);
    open.pop_back();
  }
  EXPECT_TRUE(open.empty()) << open.back();
  EXPECT_EQ(matched, size_t(std::count(body.begin(), body.end(), '<'))) << "a '<' that is no tag";
}

TEST(ReportPage, tellsEverythingOfAFullReport) {
  const std::vector<uint8_t> png = {0x89, 'P', 'N', 'G', 1, 2, 3};
  const std::string page = renderReportPage(fullReport(), {{"The map from above", png}}, circles());
  expectBalanced(page);
  for (const std::string word : {"alpha", "bravo-9-0", "refused: inlier_ratio", "18.7 mm", "4.1 mm", "91.3 %", "88.4 s",
                                 "12.3", "812345", "llvmpipe", "9f86d081884c7d65", "210.00", "fusion.depth_max_m",
                                 "data:image/png;base64,iVBORwECAw==", "<polyline points=", "The map from above"}) {
    EXPECT_NE(page.find(word), std::string::npos) << word;
  }
  if (const char* keep = std::getenv("COMAP_REPORT_PAGE")) std::ofstream(keep) << page;
}

TEST(ReportPage, aRobotHasOneColourEverywhere) {
  const std::vector<uint8_t> png = {1};
  const std::string page = renderReportPage(fullReport(), {{"contribution", png, true}}, circles());
  EXPECT_EQ(page.find("<span class=\"c0\"><i></i>alpha"), std::string::npos);
  EXPECT_EQ(page.find("<g class=\"c0\"><title>alpha"), std::string::npos);
  const auto count = [&](const std::string& text) {
    size_t found = 0;
    for (size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<span class=\"c1\"><i></i>alpha"), 3u) << "legends of picture, trajectories, errors";
  EXPECT_EQ(count("<g class=\"c1\"><title>alpha"), 3u) << "trajectories, errors, timeline";
  EXPECT_NE(page.find(".c0{color:#e6553c}"), std::string::npos) << "the pictures' own colours";
}

TEST(ReportPage, theTruthIsDrawnWhereItIsKnown) {
  std::vector<ReportTrajectory> robots = circles();
  EXPECT_NE(renderReportPage(fullReport(), {}, robots).find("class=\"truth\""), std::string::npos);
  for (ReportTrajectory& robot : robots) {
    robot.truth.clear();
    robot.errors.clear();
  }
  const std::string without = renderReportPage(fullReport(), {}, robots);
  EXPECT_EQ(without.find("class=\"truth\""), std::string::npos);
  EXPECT_EQ(without.find("Error over time"), std::string::npos);
}

TEST(ReportPage, aLineOfErrorsIsBrokenWhereTheRobotWasLost) {
  const auto lines = [](double gap_s) {
    ReportTrajectory robot{"a", {}, "m"};
    for (int i = 0; i < 20; ++i) robot.errors.push_back({i / 10.0 + (i < 10 ? 0 : gap_s), 0.01});
    const std::string page = renderReportPage(json(), {}, {robot});
    size_t found = 0;
    for (size_t at = page.find("<polyline"); at != std::string::npos; at = page.find("<polyline", at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(lines(0), 1u);
  EXPECT_EQ(lines(5), 2u);
}

TEST(ReportPage, mergesStandOnTheTimelineAndThoseTakenBackAreMarked) {
  const std::string page = renderReportPage(fullReport(), {}, {});
  EXPECT_NE(page.find("When maps became one"), std::string::npos);
  EXPECT_NE(page.find("<g class=\"merge\">"), std::string::npos);
  EXPECT_NE(page.find("<g class=\"merge undone\">"), std::string::npos);
}

TEST(ReportPage, whereTheDepthPicturesContradictTheTruthIsSaid) {
  json report = fullReport();
  EXPECT_EQ(renderReportPage(report, {}, {}).find("The truth against"), std::string::npos);
  json steps = json::array();
  for (int i = 0; i < 9; ++i)
    steps.push_back({{"from", "a/1/" + std::to_string(100 + i)}, {"truth_sigma", 2.64}, {"apart_m", 0.0304}});
  report["truth_fit"] = {
      {"steps", 33}, {"estimate_fits_better", 9}, {"truth_fits_better", 0}, {"contradicted", std::move(steps)}};
  const std::string page = renderReportPage(report, {}, {});
  EXPECT_NE(page.find("Of 33 steps"), std::string::npos);
  EXPECT_NE(page.find("than the truth at 9, the truth far better at 0"), std::string::npos);
  EXPECT_NE(page.find(">a/1/107<"), std::string::npos);
  EXPECT_EQ(page.find(">a/1/108<"), std::string::npos) << "the worst eight";
  report["truth_fit"] = {{"steps", "many"}, {"contradicted", 7}};
  EXPECT_NE(renderReportPage(report, {}, {}).find("Of many steps"), std::string::npos) << "any type is taken";
}

TEST(ReportPage, aTableOfNothingIsNotShown) {
  json report = fullReport();
  report["surface"] = {{"accuracy_mean_m", nullptr}, {"completeness_2cm", nullptr}};
  EXPECT_EQ(renderReportPage(report, {}, {}).find("<h2>Surface"), std::string::npos);
}

TEST(ReportPage, loadsNothingFromAnywhere) {
  const std::string page = renderReportPage(fullReport(), {{"t", {1}}}, circles());
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find("@import"), std::string::npos);
  EXPECT_EQ(page.find("url("), std::string::npos);
  const std::regex source("(src|href)=\"(?!data:)");
  EXPECT_FALSE(std::regex_search(page, source));
}

TEST(ReportPage, textIsNeverMarkup) {
  const std::string evil = "<script>alert(\"1\")</script>' onload='x\x01";
  json report = fullReport();
  report["robots"] = {{evil, {{"keyframes", 1}, {"map", evil}, {"odometry_ms", {{"median", 1}}}}}};
  report["maps"] = {{{"id", evil}, {"robots", {evil}}}};
  report["merges"] = {{{"kept", evil}, {"absorbed", evil}}};
  report["verdicts"] = {{"accepted", 1}, {"refused", {{evil, 2}}}};
  report["version"] = evil;
  report["parameters"] = {{evil, evil}, {"o", {{evil, evil}}}};
  report["core"]["device"] = evil;
  const std::string page =
      renderReportPage(report, {{evil, {1, 2}}}, {{evil, {{0, 0, 0}}, evil}, {"b", {{1, 1, 1}}, "n"}});
  expectBalanced(page);
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find("' onload"), std::string::npos);
  EXPECT_EQ(page.find('\x01'), std::string::npos);
  EXPECT_NE(page.find("&lt;script&gt;alert(&quot;1&quot;)&lt;/script&gt;"), std::string::npos);
}

TEST(ReportPage, anyKeyMayBeMissingNullOrOdd) {
  expectBalanced(renderReportPage(json(), {}, {}));
  expectBalanced(renderReportPage(json::array({1, 2}), {}, {}));
  const json full = fullReport();
  for (const auto& [key, value] : full.items()) {
    for (const json& odd : {json(), json(3), json("text"), json::array({1, "a", json::object()}), json::object(),
                            json({{"a", json::array()}}), json(true), json("\xff\xfe")}) {
      json report = full;
      report[key] = odd;
      expectBalanced(renderReportPage(report, {}, {}));
    }
    json report = full;
    report.erase(key);
    expectBalanced(renderReportPage(report, {}, {}));
  }
  json report = full;
  report["robots"]["alpha"] = nullptr;
  report["joint_ate_rmse_m"] = std::numeric_limits<double>::quiet_NaN();
  expectBalanced(renderReportPage(report, {{"empty", {}}}, {}));
}

TEST(ReportPage, plotsOnlyWhatIsFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string none = renderReportPage(json(), {}, {{"a", {{nan, 0, 0}}, ""}, {"b", {}, ""}});
  EXPECT_EQ(none.find("<svg"), std::string::npos);
  const std::string some = renderReportPage(json(), {},
                                            {{"a",
                                              {{nan, 0, 0}, {1, 0, 1}, {1e300, 0, 0}, {2, 0, 2}},
                                              "",
                                              0,
                                              {{nan, nan, nan}},
                                              {{nan, 1}, {1, nan}, {1, 1e300}, {2, 0.1}, {1e200, 1}}}});
  EXPECT_NE(some.find("<svg"), std::string::npos);
  EXPECT_EQ(some.find("nan"), std::string::npos);
  EXPECT_EQ(some.find("inf"), std::string::npos);
  expectBalanced(renderReportPage(json(), {}, {{"a", {{1, 0, 1}}, ""}}));
  std::vector<Eigen::Vector3d> many(200000, {0, 0, 0});
  for (size_t i = 0; i < many.size(); ++i) many[i].x() = double(i);
  EXPECT_LT(renderReportPage(json(), {}, {{"a", many, ""}}).size(), 200000u);
}

TEST(Html, base64AsTheStandardSays) {
  const auto of = [](const std::string& text) {
    return base64(std::span(reinterpret_cast<const uint8_t*>(text.data()), text.size()));
  };
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of("f"), "Zg==");
  EXPECT_EQ(of("fo"), "Zm8=");
  EXPECT_EQ(of("foobar"), "Zm9vYmFy");
}

}  // namespace
}  // namespace comap
