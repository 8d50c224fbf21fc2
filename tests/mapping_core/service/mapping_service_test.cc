// What the service says of its robots and its store, to who operates it.
#include "mapping_core/service/mapping_service.h"

#include <gmock/gmock.h>

#include "mapping_core/service/core_metrics.h"
#include "protocol/codec/codec.h"
#include "protocol/codec/message_checksum.h"
#include "protocol/link/loopback_link.h"
#include "tests/mapping_core/gpu/test_device.h"
#include "tests/mapping_core/service/room_fleet.h"
#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

using std::chrono::milliseconds;
using testing::HasSubstr;
using testing::Not;

// A core and the wire to it.
struct Core {
  Core(gpu::Device& device, MapStore& store, const ServiceOptions& options = {})
      : link(hub.connect(LinkRole::kCore)),
        service(options, *link, store, device, [](LogLevel, const std::string&) {}) {}

  // A robot says hello, and how it does.
  void hear(const std::string& robot, uint64_t session, bool finished) {
    const auto wire = hub.connect(LinkRole::kRobot, robot);
    const uint64_t book = FernBook::standard(FernBook::kStandardSeed).hash();
    ASSERT_TRUE(wire->publish(Topic::kHello, robot, *encodeHello({robot, session, book, "x"})));
    Status status;
    status.robot = robot;
    status.session = session;
    status.finished = finished;
    ASSERT_TRUE(wire->publish(Topic::kStatus, robot, *encodeStatus(status)));
    ASSERT_TRUE(service.step(milliseconds(0)));
  }
  std::string metrics() const { return reportOf(service, "none", true).metrics.text(); }

  LoopbackHub hub;
  std::unique_ptr<Link> link;
  MappingService service;
};

class Service : public StoreTest {};

TEST_F(Service, MissesAfterARestartWhoWasThereAndNotWhoHadEnded) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  {
    Core first(device, *store);
    for (const char* robot : {"here", "gone", "again"}) first.hear(robot, 1, false);
    first.hear("gone", 1, true);
    first.hear("again", 1, true);
    first.hear("again", 2, false);
    EXPECT_THAT(first.metrics(), HasSubstr("comap_core_robots 3\n"));
  }
  Core second(device, *store);
  ASSERT_TRUE(second.service.resume());
  const std::string metrics = second.metrics();
  EXPECT_THAT(metrics, HasSubstr("comap_core_robot_silent_seconds{robot=\"here\"}"));
  EXPECT_THAT(metrics, HasSubstr("comap_core_robot_silent_seconds{robot=\"again\"}"));
  EXPECT_THAT(metrics, Not(HasSubstr("comap_core_robot_silent_seconds{robot=\"gone\"}")));
  EXPECT_THAT(metrics, HasSubstr("comap_core_robots 0\n")) << "missed, not heard";
  second.hear("here", 2, true);
  EXPECT_THAT(second.metrics(), Not(HasSubstr("comap_core_robot_silent_seconds{robot=\"here\"}")));
}

// A robot's end of the wire.
struct Robot {
  explicit Robot(Core& core) : wire(core.hub.connect(LinkRole::kRobot, "a")) {
    const uint64_t book = FernBook::standard(FernBook::kStandardSeed).hash();
    EXPECT_TRUE(wire->publish(Topic::kHello, "a", *encodeHello({"a", 1, book, "x"})));
  }
  void send(std::span<const uint8_t> keyframe) { EXPECT_TRUE(wire->publish(Topic::kKeyframe, "a", keyframe)); }
  Acknowledgement lastAnswer() {
    Acknowledgement last;
    while (auto delivery = wire->receive(milliseconds(0)))
      if (delivery->topic == Topic::kAck) last = *decodeAcknowledgement(delivery->payload);
    return last;
  }
  std::unique_ptr<Link> wire;
};

std::vector<uint8_t> encodedKeyframe(uint32_t sequence) {
  Keyframe keyframe = roomKeyframe('a', static_cast<int>(sequence));
  keyframe.id = {"a", 1, sequence};
  keyframe.linked = false;
  return *encodeKeyframe(keyframe);
}

TEST_F(Service, AKeyframeThatCannotBeReadIsRefusedToItsRobot) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  Core core(device, *store);
  Robot robot(core);
  std::vector<uint8_t> other_major = encodedKeyframe(0), damaged = other_major;
  ASSERT_EQ(other_major[1], kProtocolMajor);
  other_major[1] = 2;
  damaged.resize(damaged.size() - 100);
  for (const auto& [message, reason] : {std::pair(other_major, "protocol major 2"), {damaged, "not a whole message"}}) {
    robot.send(message);
    ASSERT_TRUE(core.service.step(milliseconds(0)));
    const Acknowledgement answer = robot.lastAnswer();
    EXPECT_THAT(answer.refused, HasSubstr(reason));
    EXPECT_EQ(answer.refused_checksum, messageChecksum(message));
    EXPECT_EQ(answer.refusal, "") << "the robot itself is served";
    EXPECT_EQ(answer.next_expected, 0u);
  }
  robot.send(encodedKeyframe(0));
  ASSERT_TRUE(core.service.step(milliseconds(0)));
  const Acknowledgement answer = robot.lastAnswer();
  EXPECT_EQ(answer.refused, "");
  EXPECT_EQ(answer.next_expected, 1u);
}

// Its robot tells what it hangs on, so the map goes on in one piece; and it is part of that when it comes after all.
TEST_F(Service, AKeyframeThatCannotBeTakenHoldsUpNoneBehindIt) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  std::vector<Keyframe> keyframes;
  for (int i = 0; i < 5; ++i) keyframes.push_back(roomKeyframe('a', i));
  const auto mapped = [&] {
    const auto stored = *store->keyframes();
    return std::count_if(stored.begin(), stored.end(), [](const StoredKeyframe& one) { return !one.map.empty(); });
  };
  {
    Core core(device, *store);
    Robot robot(core);
    const auto stepAll = [&] {
      while (*core.service.step(milliseconds(0))) {
      }
    };
    std::vector<uint8_t> damaged = *encodeKeyframe(keyframes[1]);
    damaged.pop_back();
    robot.send(damaged);
    stepAll();
    EXPECT_NE(robot.lastAnswer().refused, "");
    for (const size_t i : {0, 2, 3}) robot.send(*encodeKeyframe(keyframes[i]));
    stepAll();
    EXPECT_EQ(mapped(), 1);
    Status status;
    status.robot = "a";
    status.session = 1;
    const Keyframe& gap = keyframes[1];
    status.refused = {{1, 1, {true, 0, gap.T_link_this, gap.information}}};
    ASSERT_TRUE(robot.wire->publish(Topic::kStatus, "a", *encodeStatus(status)));
    stepAll();
    EXPECT_EQ(mapped(), 3);
    EXPECT_EQ(core.service.state().surfels.size(), 1u) << "one map";
    const Acknowledgement answer = robot.lastAnswer();
    EXPECT_EQ(answer.next_expected, 1u) << "it is not taken for delivered";
    EXPECT_EQ(answer.also_held, (std::vector<uint32_t>{2, 3}));
    EXPECT_EQ(answer.mapped_below, 4u);
    robot.send(*encodeKeyframe(gap));
    stepAll();
    EXPECT_EQ(mapped(), 4);
    EXPECT_EQ(core.service.state().surfels.size(), 1u);
    const Acknowledgement last = robot.lastAnswer();
    EXPECT_EQ(last.next_expected, 4u);
    EXPECT_EQ(last.mapped_below, 4u) << "it does not go back";
  }
  Core core(device, *store);
  ASSERT_TRUE(core.service.resume());
  Robot robot(core);
  robot.send(*encodeKeyframe(keyframes[4]));
  while (*core.service.step(milliseconds(0))) {
  }
  EXPECT_EQ(mapped(), 5);
  EXPECT_EQ(core.service.state().surfels.size(), 1u);
  ASSERT_TRUE(core.service.finish({}));
  const auto stored = store->keyframes();
  ASSERT_TRUE(stored);
  for (const StoredKeyframe& one : *stored) {
    const Pose truth = roomPose('a', 0).inverse() * roomPose('a', one.id.sequence);
    EXPECT_LT((one.T_map_cam.translation() - truth.translation()).norm(), 0.01) << toString(one.id);
  }
}

TEST_F(Service, FusesInHalfDetailFromALoadOn) {
  COMAP_DEVICE_OR_SKIP(device);
  std::vector<uint64_t> surfels;  // of the second keyframe: of the first nothing is known that could be a load
  for (const double bound : {0.0, 1000.0, 1e-9}) {
    auto store = MapStore::open(folder_ / (std::to_string(surfels.size()) + ".comap"), MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(store);
    ServiceOptions options;
    options.half_detail_from_load = bound;
    Core core(device, *store, options);
    Robot robot(core);
    for (const uint32_t sequence : {0u, 1u}) {
      robot.send(encodedKeyframe(sequence));
      ASSERT_TRUE(core.service.step(milliseconds(0)));
    }
    const auto state = core.service.state();
    ASSERT_EQ(state.keyframes, 2u);
    surfels.push_back(state.surfels.at("a-1-1"));
  }
  EXPECT_GT(surfels[0], 0u);
  EXPECT_EQ(surfels[1], surfels[0]);
  EXPECT_LT(2 * surfels[2], surfels[0]);
}

TEST_F(Service, WhatIsWrittenIntoADeletedStoreIsNotAcknowledged) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  Core core(device, *store);
  Robot robot(core);
  robot.send(encodedKeyframe(0));
  ASSERT_TRUE(core.service.step(milliseconds(0)));
  EXPECT_EQ(robot.lastAnswer().next_expected, 1u);
  const auto elsewhere = folder_ / "elsewhere";
  std::filesystem::rename(path_, elsewhere);
  robot.send(encodedKeyframe(1));
  ASSERT_TRUE(core.service.step(milliseconds(0)));
  EXPECT_EQ(robot.lastAnswer().next_expected, 0u) << "no answer";
  EXPECT_THAT(core.metrics(), HasSubstr("comap_core_store_failing 1\n"));
  const Telemetry::Report report = reportOf(core.service, "none", true);
  EXPECT_FALSE(report.readiness.ready);
  EXPECT_THAT(report.readiness.state, HasSubstr("was deleted or moved away while this core writes it"));
  EXPECT_FALSE(core.service.finish({}));
  std::filesystem::rename(elsewhere, path_);
  robot.send(encodedKeyframe(1));
  ASSERT_TRUE(core.service.step(milliseconds(0)));
  EXPECT_EQ(robot.lastAnswer().next_expected, 2u) << "it is back";
}

TEST_F(Service, WhoIsForgottenIsNotMissed) {
  COMAP_DEVICE_OR_SKIP(device);
  auto store = create();
  ASSERT_TRUE(store);
  keep(*store, roomKeyframe('a', 0));
  ASSERT_TRUE(store->setPresent("a", true));
  ASSERT_TRUE(store->setPresent("b", true));
  EXPECT_EQ(*store->presences(), (std::map<std::string, bool>{{"a", true}, {"b", true}}));
  ASSERT_TRUE(store->removeRobot("a"));
  EXPECT_EQ(*store->presences(), (std::map<std::string, bool>{{"b", true}}));
}

}  // namespace
}  // namespace comap
