// The agent against a core that the test plays by hand: frames to keyframes, and what becomes of these.
#include <algorithm>

#include "edge_agent/agent_metrics.h"
#include "protocol/codec/message_checksum.h"
#include "tests/edge_agent/agent/agent_fixture.h"

namespace comap {
namespace {

using std::chrono::milliseconds;

TEST_F(AgentTest, ShipsAChainOfKeyframesThatAddsUpToThePath) {
  WalkSource source(40, 0, 0, -1);
  Agent agent = makeAgent(source);
  const auto keyframes = play(agent);
  ASSERT_GE(keyframes.size(), 3u);
  EXPECT_TRUE(agent.allAcknowledged());
  EXPECT_TRUE(agent.allMapped());
  Pose T_first_this;
  for (size_t i = 0; i < keyframes.size(); ++i) {
    EXPECT_EQ(keyframes[i].id, (KeyframeId{"r", kSession, static_cast<uint32_t>(i)}));
    EXPECT_EQ(keyframes[i].linked, i > 0);
    EXPECT_EQ(keyframes[i].fern_code.book_hash, FernBook::standard().hash());
    if (i > 0) T_first_this = T_first_this * keyframes[i].T_link_this;
    const double walked = 0.02 * static_cast<double>(keyframes[i].stamp_ns) / 33e6;
    EXPECT_NEAR(T_first_this.translation().x(), walked, 0.001 + 0.005 * walked);  // half a percent of the path
    EXPECT_LT((T_first_this.inverse() * keyframes[i].T_odom_cam).translation().norm(), 1e-9);
  }
  ASSERT_EQ(frames_.size(), 40u);
  EXPECT_EQ(agent.statistics().odometry_ms.count(), 40u);
  EXPECT_EQ(agent.statistics().first_stamp_ns, frames_.front().stamp_ns);
  EXPECT_EQ(agent.statistics().last_stamp_ns, frames_.back().stamp_ns);
}

TEST_F(AgentTest, SendsNothingBeforeTheCoreHasAnswered) {
  WalkSource source(3, 0, 0, -1);
  Agent agent = makeAgent(source);
  ASSERT_TRUE(agent.hello());
  ASSERT_TRUE(agent.takeFrame());
  ASSERT_TRUE(agent.closeKeyframe());
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  while (auto delivery = core_->receive(milliseconds(0))) EXPECT_NE(delivery->topic, Topic::kKeyframe);
  acknowledge(0);
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  std::vector<Keyframe> keyframes;
  serve(keyframes);
  EXPECT_EQ(keyframes.size(), 1u);
}

TEST_F(AgentTest, PausesWhenTheCoreDoesNotAcknowledge) {
  config_.max_waiting_keyframes = 2;
  WalkSource source(60, 0, 0, -1);
  Agent agent = makeAgent(source);
  ASSERT_TRUE(agent.hello());
  acknowledge(0);
  Agent::Progress progress = Agent::Progress::kFrame;
  for (int i = 0; i < 60 && progress == Agent::Progress::kFrame; ++i) {
    progress = *agent.takeFrame();
    ASSERT_TRUE(agent.exchange(milliseconds(0)));
  }
  EXPECT_EQ(progress, Agent::Progress::kWaiting);
  EXPECT_EQ(agent.unacknowledged(), 2u);
}

TEST_F(AgentTest, ALongBlackoutStartsANewChainAndIsTold) {
  config_.recovery.patience_frames = 0;
  WalkSource source(60, 20, 40, -1);
  Agent agent = makeAgent(source);
  const auto keyframes = play(agent);
  size_t chains = 0;
  for (const Keyframe& keyframe : keyframes) {
    chains += !keyframe.linked;
    EXPECT_TRUE(keyframe.T_odom_cam.isFinite());
  }
  EXPECT_EQ(chains, 2u);
  EXPECT_GT(agent.statistics().lost_frames, 0u);
  bool told = false;
  for (const std::string& line : log_) told = told || line.find("lost") != std::string::npos;
  EXPECT_TRUE(told);
  // Lost frames stand nowhere and are in no trajectory.
  EXPECT_EQ(frames_.size(), 60u - agent.statistics().lost_frames);
}

// Covered up, carried to a place it has seen, uncovered. A room just like it would look the same: nothing ties the new
// chain to the old one but what the core makes of it.
TEST_F(AgentTest, CarriedOffToAKnownPlaceItBeginsAChainThere) {
  WalkSource source(70, 30, 45, -1);
  source.carried_off = true;
  Agent agent = makeAgent(source);
  const auto keyframes = play(agent);
  EXPECT_EQ(agent.statistics().relocalised, 1u);
  ASSERT_EQ(agent.statistics().chains, 2u);
  size_t begun = 0;
  for (size_t i = 1; i < keyframes.size(); ++i) {
    begun += !keyframes[i].linked;
    if (begun == 0) continue;
    const double at = 0.02 * (static_cast<double>(keyframes[i].stamp_ns) / 33e6 - 45);
    EXPECT_NEAR(keyframes[i].T_odom_cam.translation().x(), at, 0.01) << "in the frame of before";
  }
  EXPECT_EQ(begun, 1u);
  // At most the blank and a few frames to make sure of the place.
  EXPECT_LE(agent.statistics().lost_frames, 10u);
}

TEST_F(AgentTest, KeyframesCarryTheMeanOfTheirWindow) {
  WalkSource source(40, 0, 0, -1);
  Agent agent = makeAgent(source);
  const auto keyframes = play(agent);
  ASSERT_GE(keyframes.size(), 3u);
  for (size_t i = 0; i + 1 < keyframes.size(); ++i) {
    const auto frames = static_cast<int>((keyframes[i + 1].stamp_ns - keyframes[i].stamp_ns) / 33'000'000);
    const Image<uint8_t>& hits = keyframes[i].depth_hits;
    ASSERT_EQ(hits.width(), keyframes[i].depth.width() / kHitBlock);
    int most = 0;
    for (size_t k = 0; k < hits.size(); ++k) most = std::max<int>(most, hits.data()[k]);
    EXPECT_EQ(most, frames) << i;
  }
}

// The core learns from it that what lies before is free.
TEST_F(AgentTest, KeyframesCarryDepthBeyondTheRangeOfOdometry) {
  constexpr float kRange_m = 2.0f;
  config_.odometry.depth_max_m = kRange_m;
  WalkSource source(20, 0, 0, -1);
  Agent agent = makeAgent(source);
  const auto keyframes = play(agent);
  ASSERT_GE(keyframes.size(), 2u);
  const Frame first = Scene::room().render(smallCamera(), WalkSource::ahead(0));
  const DepthImage& depth = keyframes[0].depth;
  size_t near = 0, far = 0, right = 0;
  for (size_t i = 0; i < depth.size(); ++i) {
    const double z = first.depth.data()[i] / kDepthUnitsPerMetre;
    near += z > 0 && z < kRange_m;
    if (z <= kRange_m) continue;
    ++far;
    right += std::abs(depth.data()[i] / kDepthUnitsPerMetre - z) < 0.001 * z * z;
  }
  EXPECT_GT(near, depth.size() / 10);
  EXPECT_GT(far, depth.size() / 10);
  EXPECT_GT(right, far * 99 / 100);  // later frames fill some at the edges of what is nearer
}

TEST_F(AgentTest, ADamagedFrameIsCountedAndPassedOver) {
  WalkSource source(20, 0, 0, 7);
  Agent agent = makeAgent(source);
  EXPECT_FALSE(play(agent).empty());
  EXPECT_EQ(agent.statistics().damaged_frames, 1u);
  EXPECT_EQ(agent.statistics().frames, 19u);
}

TEST_F(AgentTest, ARefusalEndsItWithTheReason) {
  WalkSource source(3, 0, 0, -1);
  Agent agent = makeAgent(source);
  acknowledge(0, "fern book differs");
  const auto exchanged = agent.exchange(milliseconds(0));
  ASSERT_FALSE(exchanged);
  EXPECT_EQ(exchanged.error().code, ErrorCode::kProblem);
  EXPECT_NE(exchanged.error().text.find("fern book differs"), std::string::npos);
}

TEST_F(AgentTest, ACoreOfAnotherProtocolEndsItWithTheReason) {
  WalkSource source(3, 0, 0, -1);
  Agent agent = makeAgent(source);
  const std::vector<uint8_t> major_9 = {0x08, 0x09};
  ASSERT_TRUE(core_->publish(Topic::kAck, "r", major_9));
  const auto exchanged = agent.exchange(milliseconds(0));
  ASSERT_FALSE(exchanged);
  EXPECT_EQ(exchanged.error().code, ErrorCode::kProblem);
  EXPECT_NE(exchanged.error().text.find("protocol major 9"), std::string::npos) << exchanged.error().text;
}

TEST_F(AgentTest, AClockThatIsSetBackIsToldAndTheMapGoesOn) {
  WalkSource source(40, 0, 0, -1);
  source.clock_set_back_at = 20;
  Agent agent = makeAgent(source);
  const auto keyframes = play(agent);
  EXPECT_EQ(agent.statistics().damaged_frames, 4u);
  EXPECT_EQ(agent.statistics().frames, 36u);
  EXPECT_EQ(agent.statistics().chains, 1u);
  EXPECT_LT(keyframes.back().stamp_ns, keyframes.front().stamp_ns);
  const auto duration = agent.statistics().last_stamp_ns - agent.statistics().first_stamp_ns;
  EXPECT_GT(duration, 0);
  EXPECT_LT(duration, 40 * 33'000'000ll);
  size_t told = 0;
  for (const std::string& line : log_) told += line.find("set back") != std::string::npos;
  EXPECT_EQ(told, 1u);
}

TEST_F(AgentTest, AKeyframeThatTheCoreCannotTakeIsToldInLogStatusAndOnThePage) {
  WalkSource source(40, 0, 0, -1);
  Agent agent = makeAgent(source);
  ASSERT_TRUE(agent.hello());
  acknowledge(0);
  for (auto taken = agent.takeFrame(); taken && *taken != Agent::Progress::kEnded; taken = agent.takeFrame()) {
    ASSERT_TRUE(agent.exchange(milliseconds(0)));
    while (auto delivery = core_->receive(milliseconds(0))) {
      if (delivery->topic != Topic::kKeyframe) continue;
      Acknowledgement ack;
      ack.robot = "r";
      ack.session = kSession;
      ack.refused = "keyframe: protocol major 2, this build speaks 1";
      ack.refused_checksum = messageChecksum(delivery->payload);
      ASSERT_TRUE(core_->publish(Topic::kAck, "r", *encodeAcknowledgement(ack)));
    }
  }
  ASSERT_TRUE(agent.exchange(milliseconds(0)));
  const size_t refused = agent.refusedKeyframes().size();
  EXPECT_GT(refused, 1u);
  EXPECT_EQ(std::count_if(log_.begin(), log_.end(),
                          [](const std::string& line) { return line.starts_with("the core refuses keyframe r/7/"); }),
            1);
  std::optional<Status> status;
  std::set<uint32_t> told;
  for (size_t i = 0; i < refused; ++i) {
    agent.sendStatus(false);
    while (auto delivery = core_->receive(milliseconds(0)))
      if (delivery->topic == Topic::kStatus) status = *decodeStatus(delivery->payload);
    ASSERT_TRUE(status);
    for (const RefusedKeyframe& one : status->refused) {
      EXPECT_EQ(one.session, kSession);
      EXPECT_EQ(one.link.linked, one.sequence > 0);
      EXPECT_EQ(one.link.linked_to, std::max(1u, one.sequence) - 1);
      told.insert(one.sequence);
    }
  }
  EXPECT_EQ(status->keyframes_refused, refused);
  EXPECT_EQ(told.size(), refused) << "in turn";
  EXPECT_GE(status->outbox, refused);
  const Telemetry::Report report = reportOf(agent, "r");
  EXPECT_NE(report.metrics.text().find("comap_agent_outbox_refused_keyframes{robot=\"r\"} " + std::to_string(refused)),
            std::string::npos);
  EXPECT_NE(report.readiness.state.find(" refused: keyframe: protocol major 2"), std::string::npos)
      << report.readiness.state;
}

TEST_F(AgentTest, DamagedMessagesArePassedOver) {
  WalkSource source(3, 0, 0, -1);
  Agent agent = makeAgent(source);
  const std::vector<uint8_t> rubbish = {0xff, 0x01, 0x02};
  for (const Topic topic : {Topic::kAck, Topic::kCorrection, Topic::kTile})
    ASSERT_TRUE(core_->publish(topic, "r", rubbish));
  EXPECT_TRUE(agent.exchange(milliseconds(0)));
  EXPECT_EQ(log_.size(), 3u);
}

}  // namespace
}  // namespace comap
