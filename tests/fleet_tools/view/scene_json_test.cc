#include "fleet_tools/view/scene_json.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "fleet_tools/render/picture_legend.h"

namespace comap {
namespace {

using Json = nlohmann::json;

KeyframeView keyframeOf(const std::string& robot, uint64_t session, uint32_t sequence, const MapId& map, double x) {
  KeyframeView keyframe;
  keyframe.id = {robot, session, sequence};
  keyframe.map = map;
  keyframe.T_map_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0));
  return keyframe;
}

TEST(SceneJson, KeyframesNameTheirRobotAndMapByNumberAndKeepLargeSessions) {
  const std::vector<RobotView> robots = {{"a", "stored", 1, 0, 0, "m1", {}}, {"b", "stored", 1, 0, 0, "m2", {}}};
  const std::vector<KeyframeView> keyframes = {keyframeOf("b", 18446744073709551615u, 4, "m2", 1.25),
                                               keyframeOf("a", 7, 0, "m1", -0.5),
                                               keyframeOf("stranger", 1, 0, "m1", 0)};
  const Json json = Json::parse(keyframesJson(keyframes, robots));
  ASSERT_EQ(json.at("keyframes").size(), 2u) << "of a robot that is not known nothing is told";
  const Json& row = json.at("keyframes")[0];
  ASSERT_EQ(row.size(), json.at("columns").size());
  EXPECT_EQ(row[0], 1);
  EXPECT_EQ(row[1], "18446744073709551615");
  EXPECT_EQ(row[2], 4);
  EXPECT_EQ(json.at("maps")[row[3].get<size_t>()], "m2");
  EXPECT_EQ(row[8], 1.25);
  EXPECT_EQ(row.back(), 1.0);
}

TEST(SceneJson, RobotsHaveTheColoursOfTheirNamesInTheOrderOfTheirBits) {
  const std::vector<RobotView> robots = {{"b", "stored", 1, 0, 0, "m", {}}, {"a", "stored", 1, 0, 0, "m", {}}};
  const Json json = Json::parse(robotsJson(robots)).at("robots");
  EXPECT_EQ(json[0].at("name"), "b");
  const auto colourOf = [](size_t place) {
    const Rgb c = robotColour(place);
    return Json({c.r, c.g, c.b});
  };
  EXPECT_EQ(json[0].at("colour"), colourOf(1));
  EXPECT_EQ(json[1].at("colour"), colourOf(0));
}

TEST(SceneJson, OnlyMatchesWithinOneMapAreEdges) {
  const std::vector<KeyframeView> keyframes = {keyframeOf("a", 1, 0, "m", 0), keyframeOf("a", 1, 1, "m", 1),
                                               keyframeOf("b", 1, 0, "other", 2)};
  Edge odometry{{"a", 1, 0}, {"a", 1, 1}, EdgeKind::kOdometry, {}, Matrix6d::Identity(), 0};
  Edge loop{{"a", 1, 0}, {"a", 1, 1}, EdgeKind::kLoop, {}, Matrix6d::Identity(), 0};
  Edge across{{"a", 1, 0}, {"b", 1, 0}, EdgeKind::kInterRobot, {}, Matrix6d::Identity(), 0};
  Edge unknown{{"a", 1, 0}, {"c", 1, 0}, EdgeKind::kInterRobot, {}, Matrix6d::Identity(), 0};
  const Json json = Json::parse(edgesJson({odometry, loop, across, unknown}, keyframes));
  ASSERT_EQ(json.at("edges").size(), 1u);
  EXPECT_EQ(json.at("edges")[0], Json({"m", "loop", 0.0, 0.0, 0.0, 1.0, 0.0, 0.0}));
}

TEST(SceneJson, TextOfAStoreIsMadeValid) {
  SiteView site;
  site.title = "bad \xff name";
  EXPECT_NO_THROW(Json::parse(siteJson(site)));
  MatchVerdict verdict;
  verdict.reason = "\xc3\x28";
  EXPECT_NO_THROW(Json::parse(verdictsJson({{"\xfe", 1}}, {verdict})));
}

}  // namespace
}  // namespace comap
