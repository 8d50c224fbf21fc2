#include "tests/benchmarks/freshness/freshness.h"

#include <gtest/gtest.h>

#include "tests/benchmarks/quantile.h"

namespace comap {
namespace {

using Json = nlohmann::json;

Json event(double at_s, const std::string& name, Json args) {
  return {{"ph", "i"}, {"name", name}, {"ts", static_cast<int64_t>(at_s * 1e6)}, {"args", std::move(args)}};
}
Json keyframe(double at_s, const std::string& id) { return event(at_s, "keyframe", {{"keyframe", id}}); }
Json mapped(double at_s, const std::string& id) { return event(at_s, "mapped", {{"keyframe", id}, {"map", "m"}}); }
Json renewed(double at_s, int revision, Json tiles) {
  return event(at_s, "renewed", {{"map", "m"}, {"revision", revision}, {"tiles", std::move(tiles)}});
}
Json hashed(double at_s, int hash) { return event(at_s, "tiles hash", {{"map", "m"}, {"hash", hash}}); }
Json held(double at_s, int x, int revision) {
  return event(at_s, "tile held", {{"map", "m"}, {"tile", {x, 0, 0}}, {"revision", revision}});
}
Json sent(double at_s, int bytes) { return event(at_s, "tile sent", {{"robot", "b"}, {"bytes", bytes}}); }

TEST(Freshness, CountsFromTheKeyframeToTheOtherRobotsThatAreInTheMap) {
  const Json core = {mapped(1.2, "a/1/0"), renewed(1.3, 2, {{0, 0, 0}}), mapped(2.5, "a/1/1"), mapped(2.6, "b/1/0"),
                     renewed(2.7, 4, {{0, 0, 0}, {7, 0, 0}})};
  const std::map<std::string, Json> robots = {{"a",
                                               {keyframe(1.0, "a/1/0"), held(1.4, 0, 2), keyframe(2.0, "a/1/1"),
                                                held(2.9, 0, 3), held(3.1, 7, 4), held(3.3, 0, 4)}},
                                              {"b", {held(1.5, 0, 2), keyframe(2.1, "b/1/0"), held(3.0, 0, 6)}},
                                              {"late", Json::array({held(9.0, 0, 4)})}};
  const Freshness found = freshnessOf(core, robots);
  // The first renewal: nobody was in the map before it. The second: keyframe a/1/1 reaches b (tile 0 in a newer
  // revision after 1.0 s, tile 7 never), b/1/0 reaches a (after 0.8 and 1.0 s; tile 0 in full only after 1.2 s).
  ASSERT_EQ(found.latency_s.size(), 3u);
  EXPECT_NEAR(quantileOf(found.latency_s, 0), 0.8, 1e-6);
  EXPECT_NEAR(quantileOf(found.latency_s, 1), 1.0, 1e-6);
  EXPECT_EQ(found.never, 1u);
  ASSERT_EQ(found.full_latency_s.size(), 3u);
  EXPECT_NEAR(quantileOf(found.full_latency_s, 1), 1.2, 1e-6);
  ASSERT_EQ(found.since_renewed_s.size(), 3u);
  EXPECT_NEAR(quantileOf(found.since_renewed_s, 0), 0.2, 1e-6);
}

TEST(Freshness, TheWorstSecondMayBeginAnywhere) {
  const Json core = {sent(1.0, 10), sent(1.6, 20), sent(1.9, 30), sent(2.55, 40), sent(2.95, 5), sent(9, 50)};
  const Downlink found = downlinkOf(core, "b");
  EXPECT_EQ(found.bytes, 155u);
  EXPECT_EQ(found.worst_second, 90u);  // 1.6 .. 2.55
  EXPECT_EQ(downlinkOf(core, "a").bytes, 0u);
}

TEST(Freshness, ARobotEndsWithTheMapAsItWasThen) {
  const Json core = {renewed(1.3, 2, {{0, 0, 0}}), hashed(1.4, 5), renewed(2.7, 4, {{0, 0, 0}}), hashed(2.8, 6),
                     renewed(8.7, 6, {{0, 0, 0}}), hashed(8.8, 7)};
  const auto robot = [](int hash) { return Json{event(5.7, "end", {{"map", "m"}, {"hash", hash}, {"tiles", 1}})}; };
  const Ending ending = endingOf(core, robot(6));
  EXPECT_EQ(ending.same, true);
  EXPECT_NEAR(ending.rest_s, 3.0, 1e-6);
  EXPECT_EQ(endingOf(core, robot(5)).same, false);
  EXPECT_EQ(endingOf(core, robot(7)).same, false);
  const Json later = {renewed(1.3, 2, {{0, 0, 0}}), hashed(6.4, 5), renewed(8.7, 6, {{0, 0, 0}}), hashed(8.8, 7)};
  EXPECT_EQ(endingOf(later, robot(5)).same, true) << "told when the robot had gone";
  const Json never = {renewed(1.3, 2, {{0, 0, 0}}), renewed(8.7, 6, {{0, 0, 0}}), hashed(8.8, 7)};
  EXPECT_EQ(endingOf(never, robot(7)).same, std::nullopt);
}

}  // namespace
}  // namespace comap
