// Who gets which tiles, and when: within budgets, what is near first, and on as soon as the link takes more.
#include "mapping_core/service/tile_delivery.h"

#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "edge_agent/map_cache/tile_cache.h"
#include "protocol/codec/codec.h"
#include "protocol/link/loopback_link.h"
#include "protocol/types/tile_distance.h"

namespace comap {
namespace {

using namespace std::chrono_literals;

const MapId kMap = "a-1-0";
constexpr uint32_t kBudget = 1'000'000;
constexpr double kRadius_m = 100;

std::vector<Tile> floors(int side, int height, size_t surfels, std::mt19937& engine) {
  std::vector<Tile> tiles;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < height; ++y)
      for (int z = 0; z < side; ++z) {
        Tile& tile = tiles.emplace_back();
        tile.key = {kMap, x, y, z};
        tile.surfels.resize(surfels);
        for (TileSurfel& s : tile.surfels) {  // nothing that packs well
          s.x = static_cast<uint16_t>(engine());
          s.y = static_cast<uint16_t>(engine());
          s.z = static_cast<uint16_t>(engine());
          s.r = static_cast<uint8_t>(engine());
        }
      }
  return tiles;
}

// Takes what is published until it is full.
class SlowLink : public Link {
 public:
  Result<void> publish(Topic topic, const std::string&, std::span<const uint8_t> payload) override {
    if (messages.size() >= room) return Error{ErrorCode::kUnreachable, "full"};
    EXPECT_EQ(topic, Topic::kTile);
    messages.emplace_back(payload.begin(), payload.end());
    return {};
  }
  bool delivered(Topic, const std::string&) const override { return true; }
  std::optional<Delivery> receive(std::chrono::milliseconds) override { return std::nullopt; }
  int peers() const override { return 1; }

  size_t room = 0;
  std::vector<std::vector<uint8_t>> messages;
};

RobotRecord& admitAt(RobotRegistry& registry, const Eigen::Vector3d& position_m) {
  RobotRecord& record = registry.admit({"b", 1, 7, "test"});
  EXPECT_EQ(record.refusal, "");
  record.correction = Correction{"b", 1, kMap, Pose(Eigen::Quaterniond::Identity(), position_m), 1};
  return record;
}

Interest interestOf(std::vector<HeldTile> held, double radius_m = kRadius_m) {
  Interest interest;
  interest.robot = "b";
  interest.session = 1;
  interest.radius_m = radius_m;
  interest.budget_bytes_per_s = kBudget;
  interest.held = std::move(held);
  return interest;
}

TEST(TileDelivery, GoesOnAsSoonAsTheLinkTakesMore) {
  std::mt19937 engine(1);
  SlowLink link;
  RobotRegistry registry(7);
  RobotRecord& record = admitAt(registry, Eigen::Vector3d::Zero());
  TileDelivery delivery(link, true);
  ASSERT_TRUE(delivery.renew(kMap, floors(10, 1, 5, engine), registry));
  EXPECT_FALSE(delivery.unfinished()) << "nobody has asked";
  link.room = 30;
  ASSERT_TRUE(delivery.answer(record, interestOf({})));
  EXPECT_EQ(link.messages.size(), 30u);
  EXPECT_TRUE(delivery.unfinished());
  link.room = 70;
  while (link.messages.size() < 70) {  // it is left alone for a moment
    ASSERT_TRUE(delivery.goOn(registry));
    std::this_thread::sleep_for(1ms);
  }
  // What changes meanwhile goes once, as it is then.
  std::vector<Tile> changed = floors(10, 1, 6, engine);
  link.room = 1000;
  while (delivery.unfinished()) {
    if (!changed.empty()) {
      ASSERT_TRUE(delivery.renew(kMap, std::exchange(changed, {}), registry));
    }
    ASSERT_TRUE(delivery.goOn(registry));
    std::this_thread::sleep_for(1ms);
  }
  EXPECT_EQ(link.messages.size(), 170u);
  std::map<TileKey, uint64_t> newest;
  for (const auto& message : link.messages) {
    const auto tile = decodeTile(message);
    ASSERT_TRUE(tile);
    EXPECT_GT(tile->revision, std::exchange(newest[tile->key], tile->revision)) << "none comes twice";
  }
  EXPECT_EQ(newest.size(), 100u);
  for (const auto& [key, revision] : newest) EXPECT_EQ(revision, 4u);
}

TEST(TileDelivery, SendsNoMoreThanIsKnownToArrive) {
  std::mt19937 engine(2);
  SlowLink link;
  link.room = 10000;
  RobotRegistry registry(7);
  RobotRecord& record = admitAt(registry, Eigen::Vector3d::Zero());
  TileDelivery delivery(link, true);
  ASSERT_TRUE(delivery.renew(kMap, floors(20, 1, 200, engine), registry));
  ASSERT_TRUE(delivery.answer(record, interestOf({})));
  const size_t first = link.messages.size();
  EXPECT_LT(first, 100u);
  for (int i = 0; i < 10; ++i) ASSERT_TRUE(delivery.goOn(registry));
  EXPECT_LE(link.messages.size(), first + 1) << "whatever is left of the last room";
  EXPECT_TRUE(delivery.unfinished());
  delivery.drop(kMap);
  EXPECT_FALSE(delivery.unfinished());
}

// Sends interests as a robot does, and takes what comes.
class LateRobot {
 public:
  LateRobot(TileDelivery& delivery, RobotRecord& record, Link& link, size_t memory_bytes)
      : delivery_(delivery), record_(record), link_(link), cache_(memory_bytes), memory_bytes_(memory_bytes) {
    cache_.setMap(kMap);
  }
  // Bytes that came.
  size_t ask(const Eigen::Vector3d& position_m) {
    record_.correction->T_map_odom = Pose(Eigen::Quaterniond::Identity(), position_m);
    cache_.stayNear(position_m, kRadius_m);
    EXPECT_TRUE(delivery_.answer(record_, interestOf(cache_.held(), cache_.reach_m())));
    size_t bytes = 0;
    while (const auto message = link_.receive(0ms)) {
      bytes += message->payload.size();
      auto tile = decodeTile(message->payload);
      EXPECT_TRUE(tile);
      EXPECT_TRUE(cache_.put(std::move(*tile))) << "what it holds is not sent";
    }
    cache_.stayNear(position_m, kRadius_m);
    EXPECT_LE(cache_.bytes(), memory_bytes_);
    return bytes;
  }
  size_t lacksWithin(double radius_m, const Eigen::Vector3d& position_m) const {
    size_t lacking = 0;
    for (const auto& [key, tile] : delivery_.tiles().all())
      if (distanceToTile(key, position_m) <= radius_m) {
        const auto held = cache_.tiles().find(key);
        lacking += held == cache_.tiles().end() || held->second->revision != tile.revision;
      }
    return lacking;
  }
  const TileCache& cache() const { return cache_; }

 private:
  TileDelivery& delivery_;
  RobotRecord& record_;
  Link& link_;
  TileCache cache_;
  size_t memory_bytes_;
};

// Takes all that is published, as a robot does that reports what it holds with each interest.
TEST(TileDelivery, ARobotOfASlowLinkHasAllRoughlyLongBeforeItHasAllInFull) {
  std::mt19937 engine(4);
  SlowLink link;
  link.room = 1'000'000;
  RobotRegistry registry(7);
  RobotRecord& record = admitAt(registry, Eigen::Vector3d::Zero());
  TileDelivery delivery(link, true);
  std::vector<Tile> tiles = floors(12, 1, 600, engine);
  for (Tile& tile : tiles)
    for (TileSurfel& s : tile.surfels) s.y = 1000;  // a floor
  ASSERT_TRUE(delivery.renew(kMap, tiles, registry));
  TileCache cache(64 << 20);
  cache.setMap(kMap);
  size_t taken = 0, bytes = 0, bytes_until_rough = 0;
  while (true) {
    Interest interest = interestOf(cache.held());
    interest.budget_bytes_per_s = 400'000;
    ASSERT_TRUE(delivery.answer(record, interest));
    const size_t before = taken;
    for (; taken < link.messages.size(); ++taken) {
      auto tile = decodeTile(link.messages[taken]);
      ASSERT_TRUE(tile);
      bytes += link.messages[taken].size();
      EXPECT_TRUE(cache.put(std::move(*tile))) << "nothing comes that is older than what it holds";
      if (bytes_until_rough == 0 && cache.tiles().size() == 144) bytes_until_rough = bytes;
    }
    bool full = cache.tiles().size() == 144;
    for (const Tile& tile : delivery.tiles().tiles(kMap)) {
      const auto held = cache.tiles().find(tile.key);
      full = full && held != cache.tiles().end() && held->second->surfels == tile.surfels;
    }
    if (full) break;
    ASSERT_LT(taken, 500u);
    if (taken == before) std::this_thread::sleep_for(20ms);  // within its budget
  }
  EXPECT_GT(bytes_until_rough, 0u);
  EXPECT_LT(bytes_until_rough, bytes / 3) << "of " << bytes;
}

// 101 x 101 m on two storeys: 20 000 tiles and more, 12 MB of them fit into the robot.
TEST(TileDelivery, ARobotThatComesLateToALargeMapHasWhatIsNearItFirst) {
  std::mt19937 engine(3);
  LoopbackHub hub;
  const auto core = hub.connect(LinkRole::kCore), robot = hub.connect(LinkRole::kRobot, "b");
  RobotRegistry registry(7);
  RobotRecord& record = admitAt(registry, Eigen::Vector3d::Zero());
  TileDelivery delivery(*core, false);
  ASSERT_TRUE(delivery.renew(kMap, floors(101, 2, 80, engine), registry));
  ASSERT_GT(delivery.tiles().all().size(), 20'000u);

  LateRobot late(delivery, record, *robot, size_t{12} << 20);
  const Eigen::Vector3d start(25, 0.5, 25);
  size_t bytes = 0, asked = 0;
  for (; late.lacksWithin(2.5, start) > 0; ++asked) {  // some 200 tiles, 180 kB
    ASSERT_LT(asked, 2u);
    const size_t came = late.ask(start);
    EXPECT_LE(came, kBudget / 2);
    EXPECT_GT(came, kBudget / 4) << "nor is the budget left unused while it lacks something";
    bytes += came;
  }
  // While the map goes on changing elsewhere and beside it, it gets the rest of what it has room for.
  for (int i = 0; i < 60; ++i, ++asked) {
    std::vector<Tile> changed = floors(4, 2, 80, engine);
    for (Tile& tile : changed) tile.key.x += i % 2 == 0 ? 48 : 3 * i % 90, tile.key.z += 48;
    ASSERT_TRUE(delivery.renew(kMap, std::move(changed), registry));
    bytes += late.ask(start);
  }
  EXPECT_EQ(late.lacksWithin(2.5, start), 0u);
  EXPECT_EQ(late.lacksWithin(late.cache().reach_m() - 1, start), 0u) << "all that it asked for";
  EXPECT_LE(bytes, asked * kBudget / 2);
  EXPECT_GT(late.cache().tiles().size(), 3000u);
  EXPECT_LT(late.cache().tiles().size(), 15'000u) << "the map would have fitted";

  // And it may walk: what is near is there after the question that follows.
  for (double x = 25; x < 45; x += 1) late.ask({x, 0.5, 25});
  EXPECT_EQ(late.lacksWithin(2.5, {44, 0.5, 25}), 0u);
}

}  // namespace
}  // namespace comap
