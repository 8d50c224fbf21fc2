#include "mapping_core/service/core_load.h"

#include <gtest/gtest.h>

namespace comap {
namespace {

using std::chrono::milliseconds;
using std::chrono::minutes;
using std::chrono::seconds;
using Time = CoreLoad::Clock::time_point;

const Time kStart = Time() + minutes(1000);

// Keyframes arrive at `arriving_ms` intervals; the core maps as many as it can, each in `keyframe_ms`.
struct Fleet {
  CoreLoad load;
  size_t waiting = 0;
  Time now = kStart, next_arrival = kStart, free_at = kStart;
  std::vector<std::string> advice;

  void run(int arriving_ms, int keyframe_ms, seconds duration) {
    for (const Time end = now + duration; now < end; now += milliseconds(10)) {
      for (; next_arrival <= now; next_arrival += milliseconds(arriving_ms)) load.arrived(now), ++waiting;
      if (waiting > 0 && free_at <= now) {
        --waiting;
        load.mapped(now, milliseconds(keyframe_ms));
        free_at = now + milliseconds(keyframe_ms);
      }
      if (auto said = load.advise(now, waiting)) advice.push_back(*said);
    }
  }
};

TEST(CoreLoad, IsTheShareOfTimeThatArrivalsNeed) {
  Fleet fleet;
  fleet.run(500, 200, seconds(120));
  const auto figure = fleet.load.figure(fleet.now);
  EXPECT_NEAR(figure.arriving_per_s, 2, 0.1);
  EXPECT_NEAR(figure.keyframe_s, 0.2, 1e-9);
  EXPECT_NEAR(figure.load(), 0.4, 0.02);
  EXPECT_TRUE(fleet.advice.empty());
}

TEST(CoreLoad, ACoreThatFallsBehindSaysSoAndNotAllTheTime) {
  Fleet fleet;
  fleet.run(250, 500, seconds(60 * 9));
  EXPECT_NEAR(fleet.load.figure(fleet.now).load(), 2, 0.1);
  ASSERT_EQ(fleet.advice.size(), 1u);
  EXPECT_NE(fleet.advice[0].find("load 2.0"), std::string::npos) << fleet.advice[0];
  fleet.run(250, 500, seconds(60 * 10));
  EXPECT_EQ(fleet.advice.size(), 2u);
}

TEST(CoreLoad, ABurstThatIsWorkedOffIsNoOverload) {
  Fleet fleet;
  fleet.run(500, 200, seconds(70));
  fleet.run(100, 200, seconds(20));  // a robot is back with what it has kept
  fleet.run(500, 200, seconds(120));
  EXPECT_TRUE(fleet.advice.empty());
  EXPECT_EQ(fleet.waiting, 0u);
}

TEST(CoreLoad, AfterAMinuteOfSilenceNothingIsLeft) {
  Fleet fleet;
  fleet.run(250, 100, seconds(30));
  EXPECT_EQ(fleet.load.figure(fleet.now + seconds(61)).load(), 0);
  EXPECT_EQ(CoreLoad().figure(kStart).load(), 0);
}

}  // namespace
}  // namespace comap
