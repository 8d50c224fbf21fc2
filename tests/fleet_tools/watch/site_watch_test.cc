#include "fleet_tools/watch/site_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fleet_tools/watch/watch_screen.h"
#include "protocol/codec/codec.h"

namespace comap {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

class SiteWatchTest : public testing::Test {
 protected:
  void hear(Topic topic, const std::string& robot, const Result<std::vector<uint8_t>>& encoded) {
    ASSERT_TRUE(encoded) << encoded.error().text;
    EXPECT_TRUE(watch_.take({topic, robot, *encoded}, now_));
  }
  void hearStatus(uint64_t session, uint32_t keyframes, uint32_t outbox, TrackingState tracking = TrackingState::kOk) {
    Status status;
    status.robot = "a";
    status.session = session;
    status.keyframes = keyframes;
    status.outbox = outbox;
    status.tracking = tracking;
    status.T_odom_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 0, 0));
    hear(Topic::kStatus, "a", encodeStatus(status));
  }
  void hearCorrection(uint64_t session, const MapId& map) {
    Correction correction;
    correction.robot = "a";
    correction.session = session;
    correction.map = map;
    correction.T_map_odom = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0, 5, 0));
    hear(Topic::kCorrection, "a", encodeCorrection(correction));
  }
  void hearMerge(uint32_t number, const MapId& kept, const MapId& absorbed, const std::string& undone = "") {
    MergeRecord merge;
    merge.number = number;
    merge.kept = kept;
    merge.absorbed = absorbed;
    merge.robots = {"a", "b"};
    merge.voters = {{"a", 1, 2}};
    merge.undone = undone;
    hear(Topic::kMerge, "", encodeMergeRecord(merge));
  }

  SiteWatch watch_;
  WatchClock::time_point now_ = WatchClock::time_point(100s);
};

TEST_F(SiteWatchTest, ARobotIsPlacedByTheCorrectionOfItsOwnSession) {
  hearCorrection(1, "a-1-0");
  hearStatus(2, 3, 0);
  EXPECT_FALSE(watch_.robots().at("a").T_map_cam()) << "of an earlier session";
  hearCorrection(2, "a-2-0");
  const auto pose = watch_.robots().at("a").T_map_cam();
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->translation(), Eigen::Vector3d(1, 5, 0));
  EXPECT_EQ(watch_.maps(), std::set<MapId>{"a-2-0"});
}

TEST_F(SiteWatchTest, StatesFollowWhatIsHeardAndSilence) {
  hearStatus(1, 1, 0, TrackingState::kPoor);
  const HeardRobot& robot = watch_.robots().at("a");
  EXPECT_EQ(stateOf(robot, now_), "poor");
  EXPECT_EQ(stateOf(robot, now_ + 4s), "poor");
  EXPECT_EQ(stateOf(robot, now_ + 6s), "silent");
  const HeardRobot unheard = HeardRobot();
  EXPECT_EQ(stateOf(unheard, now_), "expected");
}

TEST_F(SiteWatchTest, RatesAreOfTheLastSecondsAndOfOneSession) {
  for (uint32_t second = 0; second <= 30; ++second) {
    hearStatus(1, 100 + 3 * second, 50 + second);  // two a second arrive
    now_ += 1s;
  }
  EXPECT_NEAR(deliveredPerSecond(watch_.robots().at("a"), now_ - 1s), 2.0, 0.01);
  hearStatus(2, 0, 0);
  EXPECT_EQ(deliveredPerSecond(watch_.robots().at("a"), now_), 0) << "a new session begins from nothing";
}

TEST_F(SiteWatchTest, AnAbsorbedMapIsNoMapUnlessTheMergeIsUndone) {
  hearCorrection(1, "b-1-0");
  hearStatus(1, 1, 0);
  hearMerge(1, "a-1-0", "b-1-0");
  EXPECT_TRUE(watch_.maps().empty());
  hearMerge(1, "a-1-0", "b-1-0", "contradicted");
  EXPECT_EQ(watch_.maps(), std::set<MapId>{"b-1-0"});
}

TEST_F(SiteWatchTest, DamagedMessagesAreCountedAndChangeNothing) {
  for (const Topic topic : {Topic::kStatus, Topic::kHello, Topic::kCorrection, Topic::kVerdict, Topic::kMerge})
    EXPECT_FALSE(watch_.take({topic, "a", {0xff, 0x01, 0x7f}}, now_));
  EXPECT_EQ(watch_.unreadable(), 5u);
  EXPECT_TRUE(watch_.robots().empty());
}

TEST_F(SiteWatchTest, TheScreenTellsRobotsMergesAndVerdicts) {
  hearCorrection(7, "a-7-0");
  hearStatus(7, 12, 5, TrackingState::kLost);
  hearMerge(1, "a-7-0", "b-1-0");
  MatchVerdict verdict;
  verdict.query = {"a", 7, 3};
  verdict.candidate = {"b", 1, 4};
  verdict.reason = "inlier_ratio";
  verdict.inlier_ratio = 0.25;
  hear(Topic::kVerdict, "", encodeMatchVerdict(verdict));
  CoreStatus core;
  core.keyframes = 40;
  core.maps = 2;
  core.queue = 3;
  core.device = "llvmpipe";
  hear(Topic::kCoreStatus, "", encodeCoreStatus(core));
  std::string screen;
  for (const std::string& line : watchScreen(watch_, "flat", true, now_)) {
    EXPECT_EQ(line.find('\n'), std::string::npos);
    screen += line + "\n";
  }
  EXPECT_THAT(screen, HasSubstr("site flat; core: 40 keyframes, 2 maps, 3 waiting, llvmpipe"));
  EXPECT_THAT(screen, HasSubstr("lost"));
  EXPECT_THAT(screen, HasSubstr("merge 1: b-1-0 into a-7-0 (a, b), 1 closures"));
  EXPECT_THAT(screen, HasSubstr("a/7/3 - b/1/4  refused: inlier_ratio (inlier_ratio 0.250)"));
  const auto json = watchJson(watch_, "flat", true, now_);
  EXPECT_EQ(json.at("robots").at("a").at("keyframes"), 12);
  EXPECT_EQ(json.at("robots").at("a").at("waiting"), 5);
  EXPECT_EQ(json.at("robots").at("a").at("state"), "lost");
  EXPECT_EQ(json.at("core").at("waiting"), 3);
  EXPECT_EQ(json.at("verdict_counts").at("inlier_ratio"), 1);
  EXPECT_EQ(json.at("merges").size(), 1u);
  EXPECT_THAT(watchLine(watch_, true, now_), HasSubstr("a lost 12 keyframes 5 waiting"));
}

}  // namespace
}  // namespace comap
