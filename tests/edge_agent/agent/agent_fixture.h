// An agent on a walk, and a core that the test plays by hand over the loopback link.
#pragma once

#include <gtest/gtest.h>

#include "edge_agent/agent.h"
#include "protocol/codec/codec.h"
#include "protocol/link/loopback_link.h"
#include "tests/scenes/scene.h"

namespace comap {

// A walk along x, with blanks (no depth, black) where asked and a damaged frame where asked. After the blank it goes on
// where it was, or, carried off, from the start once more.
class WalkSource final : public FrameSource {
 public:
  WalkSource(int frames, int blank_from, int blank_to, int damaged)
      : frames_(frames), blank_from_(blank_from), blank_to_(blank_to), damaged_(damaged) {}

  Result<std::optional<Frame>> next() override {
    const int i = next_++;
    if (i >= frames_) return std::optional<Frame>();
    if (i == damaged_) return Error{ErrorCode::kBadData, "frame 7 is damaged"};
    const int step = carried_off && i >= blank_to_ ? i - blank_to_ : i;
    const Pose T_world_cam = turned_away && i >= blank_to_ ? away(i - blank_to_) : ahead(step);
    const int64_t set_back_ns = i >= clock_set_back_at ? 3'600'000'000'000ll : 0;
    Frame frame = scene_.render(smallCamera(), T_world_cam, i * 33'000'000ll - set_back_ns);
    if (i >= blank_from_ && i < blank_to_) {
      frame.colour = ColourImage(frame.colour.width(), frame.colour.height());
      frame.depth = DepthImage(frame.depth.width(), frame.depth.height());
    }
    return std::optional<Frame>(std::move(frame));
  }
  size_t size() const override { return static_cast<size_t>(frames_); }
  std::string description() const override { return "walk"; }

  static Pose ahead(int step) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.02 * step, 0, 0)}; }
  // In another part of the room, which the walk never sees.
  static Pose away(int step) {
    return {Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY())),
            Eigen::Vector3d(0.5 - 0.02 * step, 0, 0)};
  }

  bool carried_off = false, turned_away = false;
  int clock_set_back_at = 1 << 30;  // by an hour

 private:
  Scene scene_ = Scene::room();
  int frames_, blank_from_, blank_to_, damaged_;
  int next_ = 0;
};

class AgentTest : public testing::Test {
 protected:
  static constexpr uint64_t kSession = 7;

  AgentTest() : core_(hub_.connect(LinkRole::kCore)), wire_(hub_.connect(LinkRole::kRobot, "r")) {
    config_.robot = "r";
  }

  Agent makeAgent(FrameSource& source) {
    return Agent(
        config_, kSession, std::move(Outbox::inMemory()).value(), source, *wire_,
        [this](const std::string& line) { log_.push_back(line); },
        [this](const FrameRecord& frame) { frames_.push_back(frame); });
  }

  void acknowledge(uint32_t next_expected, const std::string& refusal = "") {
    Acknowledgement ack;
    ack.robot = "r";
    ack.session = kSession;
    ack.next_expected = ack.mapped_below = next_expected;
    ack.refusal = refusal;
    ASSERT_TRUE(core_->publish(Topic::kAck, "r", *encodeAcknowledgement(ack)));
  }

  // The core's side: takes keyframes and acknowledges each.
  void serve(std::vector<Keyframe>& keyframes) {
    while (auto delivery = core_->receive(std::chrono::milliseconds(0))) {
      if (delivery->topic == Topic::kHello) acknowledge(0);
      if (delivery->topic != Topic::kKeyframe) continue;
      auto keyframe = decodeKeyframe(delivery->payload);
      ASSERT_TRUE(keyframe) << keyframe.error().text;
      keyframes.push_back(std::move(*keyframe));
      acknowledge(keyframes.back().id.sequence + 1);
    }
  }

  // That the core has received since it was last asked.
  int interests() {
    int count = 0;
    while (auto delivery = core_->receive(std::chrono::milliseconds(0))) count += delivery->topic == Topic::kInterest;
    return count;
  }

  std::vector<Keyframe> play(Agent& agent) {
    std::vector<Keyframe> keyframes;
    EXPECT_TRUE(agent.hello());
    for (;;) {
      serve(keyframes);
      EXPECT_TRUE(agent.exchange(std::chrono::milliseconds(0)));
      const auto taken = agent.takeFrame();
      EXPECT_TRUE(taken) << taken.error().text;
      if (!taken || *taken == Agent::Progress::kEnded) break;
    }
    EXPECT_TRUE(agent.exchange(std::chrono::milliseconds(0)));
    serve(keyframes);
    EXPECT_TRUE(agent.exchange(std::chrono::milliseconds(0)));
    return keyframes;
  }

  LoopbackHub hub_;
  std::unique_ptr<Link> core_, wire_;
  AgentConfig config_;
  std::vector<std::string> log_;
  std::vector<FrameRecord> frames_;
};

}  // namespace comap
