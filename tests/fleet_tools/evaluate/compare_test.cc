// Two modes side by side, and merges of the paper mode against the truth.
#include "fleet_tools/evaluate/compare.h"

#include <gtest/gtest.h>

#include "fleet_tools/evaluate/evaluate_paper.h"
#include "fleet_tools/report/compare_page.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

using nlohmann::json;

json reportOf(double ate, double joint, double bytes) {
  return {{"robots", {{"a", {{"ate_rmse_m", ate}, {"frames", 100}, {"uplink_bytes", bytes}}}}},
          {"joint_ate_rmse_m", joint},
          {"maps", {{{"id", "a"}}}},
          {"merges", json::array()},
          {"closures", {{"false_merges_standing", 0}}},
          {"wall_s", 5.0}};
}

TEST(Compare, SaysWhatIsSo) {
  const json said = compareJson({{"a", reportOf(0.01, 0.01, 1e6), reportOf(0.02, 0.02, 2e7)}});
  EXPECT_TRUE(said.at("at_least_as_accurate").get<bool>());
  EXPECT_TRUE(said.at("a_tenth_of_the_bytes").get<bool>());
  EXPECT_TRUE(said.at("not_so").empty());
  EXPECT_DOUBLE_EQ(said.at("inputs")[0].at("paper").at("wall_ms_per_frame").get<double>(), 50);
  EXPECT_DOUBLE_EQ(said.at("inputs")[0].at("bytes_share").get<double>(), 0.05);
}

TEST(Compare, SaysPlainlyWhereThePaperModeIsBetter) {
  json graph = reportOf(0.03, 0.03, 3e6);
  graph["maps"].push_back({{"id", "b"}});
  graph["joint_ate_rmse_m"] = nullptr;
  const json said = compareJson({{"a", graph, reportOf(0.02, 0.02, 2e7)}});
  EXPECT_FALSE(said.at("at_least_as_accurate").get<bool>());
  EXPECT_FALSE(said.at("a_tenth_of_the_bytes").get<bool>());
  EXPECT_EQ(said.at("not_so").size(), 3u) << said.at("not_so").dump();  // own, maps, bytes
  const std::string text = compareText(said);
  EXPECT_NE(text.find("at least as accurate in each row: no"), std::string::npos) << text;
  EXPECT_NE(text.find("not a tenth"), std::string::npos) << text;
}

TEST(Compare, AFalseMergeIsNoMerit) {
  json graph = reportOf(0.01, 0, 1e6), paper = reportOf(0.01, 4.0, 2e7);
  graph["joint_ate_rmse_m"] = nullptr;
  graph["maps"].push_back({{"id", "b"}});
  EXPECT_FALSE(compareJson({{"a", graph, paper}}).at("at_least_as_accurate").get<bool>());
  paper["closures"]["false_merges_standing"] = 1;
  EXPECT_TRUE(compareJson({{"a", graph, paper}}).at("at_least_as_accurate").get<bool>());
  EXPECT_FALSE(compareJson({{"a", paper, graph}}).at("at_least_as_accurate").get<bool>());
}

TEST(Compare, WithoutTruthNothingIsClaimed) {
  json graph = reportOf(0, 0, 1e6), paper = reportOf(0, 0, 2e7);
  for (json* report : {&graph, &paper}) {
    (*report)["joint_ate_rmse_m"] = nullptr;
    (*report)["robots"]["a"]["ate_rmse_m"] = nullptr;
  }
  EXPECT_TRUE(compareJson({{"a", graph, paper}}).at("at_least_as_accurate").is_null());
}

TEST(Compare, SaysWhereErrorsAreMissingOrOfDifferentFrames) {
  json graph = reportOf(0.01, 0.01, 1e6), paper = reportOf(0.02, 0.02, 2e7);
  graph["robots"]["a"]["ate_pairs"] = paper["robots"]["a"]["ate_pairs"] = 100;
  EXPECT_TRUE(compareJson({{"a", graph, paper}}).at("notes").empty());
  graph["robots"]["a"]["ate_pairs"] = 88;
  json said = compareJson({{"a", graph, paper}});
  ASSERT_EQ(said.at("notes").size(), 1u);
  EXPECT_NE(said.at("notes")[0].get<std::string>().find("88"), std::string::npos) << said.at("notes").dump();
  EXPECT_NE(compareText(said).find("a:88/100"), std::string::npos) << compareText(said);
  EXPECT_NE(comparePage(said, {}, {}).find("a:88/100"), std::string::npos);

  graph["robots"]["a"].update({{"ate_rmse_m", nullptr}, {"ate_pairs", 2}, {"ate_reason", "too short"}});
  said = compareJson({{"a", graph, paper}});
  ASSERT_FALSE(said.at("notes").empty());
  EXPECT_NE(said.at("notes")[0].get<std::string>().find("graph mode: none, too short"), std::string::npos)
      << said.at("notes").dump();
  EXPECT_FALSE(said.at("at_least_as_accurate").get<bool>());
}

TEST(Compare, ARemedyOfTheWholeRowIsInItsNameAndToldOf) {
  json paper = reportOf(0.02, 0.02, 2e7);
  paper["fixes"] = {{"two_votes", true}, {"noise_weights", false}};
  const json said = compareJson({{"a", reportOf(0.01, 0.01, 1e6), paper}});
  EXPECT_NE(compareText(said).find("paper + two-votes"), std::string::npos) << compareText(said);
  EXPECT_EQ(compareText(said).find("noise-weights"), std::string::npos) << compareText(said);
  EXPECT_NE(comparePage(said, {}, {}).find("paper + two-votes"), std::string::npos);
  ASSERT_EQ(said.at("notes").size(), 1u) << said.at("notes").dump();
  EXPECT_NE(said.at("notes")[0].get<std::string>().find("not as published"), std::string::npos);
}

// Two robots, each in a map of its own; b's is the larger one in the paper mode.
json apart(double surfels_a, double surfels_b, double doubles) {
  json report = reportOf(0.01, 0, 2e7);
  report["robots"]["b"] = report["robots"]["a"];
  report["joint_ate_rmse_m"] = nullptr;
  report["joint_ate_reason"] = "the robots are in 2 maps";
  report["surface_reason"] = "no alignment: the robots are in 2 maps";
  report["double_surface"] = doubles;
  report["maps"] = {{{"id", "a"}, {"robots", {"a"}}, {"surfels", surfels_a}},
                    {{"id", "b"}, {"robots", {"b"}}, {"surfels", surfels_b}}};
  return report;
}

TEST(Compare, MapsOfDifferentRobotsAreNotCompared) {
  json said = compareJson({{"a+b", apart(200, 100, 0.03), apart(100, 200, 0.01)}});
  EXPECT_EQ(said.at("inputs")[0].at("graph").at("largest_map"), json({"a"}));
  EXPECT_EQ(said.at("inputs")[0].at("paper").at("largest_map"), json({"b"}));
  EXPECT_EQ(said.at("not_so").size(), 1u) << "bytes, not doubles: " << said.at("not_so").dump();
  EXPECT_NE(said.at("notes").dump().find("not of the same robots"), std::string::npos) << said.at("notes").dump();
  EXPECT_NE(said.at("notes").dump().find("largest of 2 maps, robot b"), std::string::npos);
  EXPECT_NE(comparePage(said, {}, {}).find(">2 maps<"), std::string::npos) << "an empty cell says why";

  said = compareJson({{"a+b", apart(200, 100, 0.03), apart(200, 100, 0.01)}});
  EXPECT_NE(said.at("not_so").dump().find("doubles"), std::string::npos) << said.at("not_so").dump();
}

TEST(Compare, WhoWasLostAndWhoHasNoTruthIsNamed) {
  json graph = reportOf(0.01, 0.01, 1e6), paper = reportOf(0.02, 0.02, 2e7);
  paper["robots"]["a"]["tracking_lost_frames"] = 12;
  for (json* report : {&graph, &paper}) (*report)["robots"]["b"] = {{"frames", 50}, {"uplink_bytes", 1.0}};
  const json said = compareJson({{"a+b", graph, paper}});
  EXPECT_EQ(said.at("inputs")[0].at("paper").at("lost_frames").at("a"), 12);
  EXPECT_NE(said.at("notes").dump().find("a was lost in 12 of 100 frames"), std::string::npos)
      << said.at("notes").dump();
  EXPECT_NE(said.at("notes").dump().find("no truth is known of b"), std::string::npos) << said.at("notes").dump();
}

TEST(Compare, ARobotByItselfIsNotListedTwiceAndATenthIsExact) {
  const json said = compareJson({{"a", reportOf(0.03, 0.03, 1.0015e6), reportOf(0.02, 0.02, 1e7)}});
  ASSERT_EQ(said.at("not_so").size(), 2u) << said.at("not_so").dump();
  EXPECT_NE(said.at("not_so")[1].get<std::string>().find("10.015 %"), std::string::npos) << said.at("not_so")[1];
}

TEST(Compare, WhyNothingIsKnownIsSaid) {
  json graph = reportOf(0, 0, 1e6), paper = reportOf(0, 0, 2e7);
  for (json* report : {&graph, &paper})
    (*report)["robots"]["a"].update({{"ate_rmse_m", nullptr}, {"ate_reason", "its trajectory has 2 poses"}});
  const std::string text = compareText(compareJson({{"a", graph, paper}}));
  EXPECT_NE(text.find("not known, no trajectory can be measured (a: its trajectory has 2 poses)"), std::string::npos)
      << text;
}

TEST(Compare, RemediesHaveRowsOfTheirOwn) {
  const json said = compareJson(
      {{"a", reportOf(0.01, 0.01, 1e6), reportOf(0.02, 0.02, 2e7), {{"two-votes", reportOf(0.0173, 0.02, 2e7)}}}});
  ASSERT_EQ(said.at("inputs")[0].at("remedies").size(), 1u);
  const std::string text = compareText(said);
  EXPECT_NE(text.find("+ two-votes"), std::string::npos) << text;
  EXPECT_NE(text.find("0.0173"), std::string::npos) << text;
  EXPECT_NE(comparePage(said, {}, {}).find("+ two-votes"), std::string::npos);
}

TEST(Compare, ThePageShowsTimesOverTheNumberOfCameras) {
  const auto timed = [](int cameras, double frame_ms, double round_ms) {
    json report = reportOf(0.02, 0.02, 2e7);
    for (int i = 1; i < cameras; ++i)
      report["robots"][std::string(1, static_cast<char>('a' + i))] = report["robots"]["a"];
    report["core"] = {{"frame_ms", {{"median", frame_ms}}}, {"round_ms", {{"median", round_ms}}}};
    return report;
  };
  const std::string page = comparePage(compareJson({{"a", reportOf(0.01, 0.01, 1e6), timed(1, 301, 301)},
                                                    {"b", reportOf(0.01, 0.01, 1e6), timed(1, 309, 309)},
                                                    {"a+b", reportOf(0.01, 0.01, 1e6), timed(2, 317, 634)}}),
                                       {}, {});
  EXPECT_NE(page.find(">305<"), std::string::npos) << "sets of one size are averaged";
  EXPECT_NE(page.find(">634<"), std::string::npos);
}

TEST(Compare, ThePageEscapesNamesAndDrawsTheRounds) {
  const TemporaryFolder folder;
  const std::string head = "tick,camera,a,b,c,d,e,f,total,maps,surfels,l,g,merged,lost,points,nodes\n";
  const auto times = readRoundTimes(
      folder.write("frames.csv", head + "1,a,0,0,0,0,0,0,40.5,2,9,0,0,0,0,0,0\n1,b,0,0,0,0,0,0,10,2,9,0,0,0,0,0,0\n"
                                        "2,a,0,0,0,0,0,0,99,1,9,0,0,1,0,0,0\n"));
  ASSERT_TRUE(times) << times.error().text;
  EXPECT_EQ(times->cameras, (std::vector<std::string>{"a", "b"}));
  EXPECT_DOUBLE_EQ(times->ms[0][0], 40.5);
  EXPECT_EQ(times->merges, std::vector<size_t>{2}) << "as events.log counts";
  const json said = compareJson({{"<i>", reportOf(0.01, 0.01, 1e6), reportOf(0.02, 0.02, 2e7)}});
  const std::string page = comparePage(said, {}, *times);
  EXPECT_EQ(page.find("<i><"), page.find("<i></i>")) << "no element of that name but the legend's";
  EXPECT_NE(page.find("&lt;i&gt;"), std::string::npos);
  EXPECT_NE(page.find("<polyline"), std::string::npos);

  const auto damaged = readRoundTimes(folder.write("bad.csv", head + "1,a,0\n"));
  ASSERT_FALSE(damaged);
  EXPECT_EQ(damaged.error().code, ErrorCode::kBadData);
  const auto words = readRoundTimes(folder.write("bad2.csv", head + "x,a,0,0,0,0,0,0,1,2,9,0,0,0,0,0,0\n"));
  ASSERT_FALSE(words);
  EXPECT_NE(words.error().text.find("bad2.csv:2"), std::string::npos) << words.error().text;
}

TEST(PaperMerges, AreHeldAgainstTheTruth) {
  const TemporaryFolder folder;
  const std::map<std::string, std::string> truths = {
      {"a", folder.write("a.txt", "1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0 1\n")},
      {"b", folder.write("b.txt", "1.0 1 0 0 0 0 0 1\n2.5 2 0 0 0 0 0 1\n")}};
  const auto merge = [](double x) {
    return json{{"query", {{"robot", "b"}, {"stamp_ns", 2500000000}}},
                {"place", {{"robot", "a"}, {"stamp_ns", 1000000000}}},
                {"T_place_query", {x, 0, 0, 0, 0, 0, 1}}};
  };
  const auto right = evaluatePaperMerges({{"merges", {merge(2.04)}}}, truths);
  ASSERT_TRUE(right) << right.error().text;
  EXPECT_EQ(right->merges, 1u);
  EXPECT_EQ(right->false_merges, 0u);
  EXPECT_DOUBLE_EQ(right->first_merge_s.value_or(0), 1.5);
  const auto wrong = evaluatePaperMerges({{"merges", {merge(2.5)}}}, truths);
  ASSERT_TRUE(wrong);
  EXPECT_EQ(wrong->false_merges_standing, 1u);
  EXPECT_FALSE(wrong->first_merge_s);
  json broken = merge(2);
  broken["T_place_query"] = "here";
  const auto refused = evaluatePaperMerges({{"merges", {broken}}}, truths);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kBadData);
}

}  // namespace
}  // namespace comap
