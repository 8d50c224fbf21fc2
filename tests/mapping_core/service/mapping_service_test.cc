// What the service says of its robots and its store, to who operates it.
#include "mapping_core/service/mapping_service.h"

#include <gmock/gmock.h>

#include "mapping_core/service/core_metrics.h"
#include "protocol/codec/codec.h"
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
  Core(gpu::Device& device, MapStore& store)
      : link(hub.connect(LinkRole::kCore)), service({}, *link, store, device, [](LogLevel, const std::string&) {}) {}

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
