// A store that is known, in a folder that goes with the test; and the verbs that ask and change it, as called from the
// command line.
#pragma once

#include <gtest/gtest.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <set>
#include <string>

#include "fleet_tools/command_line/verb.h"
#include "mapping_core/store/map_store.h"
#include "mapping_core/tiles/tile_builder.h"
#include "tests/files/temporary_folder.h"

namespace comap {

struct Outcome {
  int code;
  std::string out, err;
};

class StoreVerbs : public ::testing::Test {
 protected:
  static KeyframeId idOf(const std::string& robot, uint32_t sequence) { return {robot, 5, sequence}; }

  // Two robots of three keyframes; `maps` 1: merged, 2: one map each.
  void fill(int maps) {
    auto store = MapStore::open(store_, MapStore::Mode::kCreateOrOpen);
    ASSERT_TRUE(store);
    ASSERT_TRUE(store->setMeta("version", "0.1.0"));
    std::vector<Tile> tiles;
    for (const std::string robot : {"alpha", "bravo"}) {
      const MapId map = maps == 1 ? "alpha-5-0" : robot + "-5-0";
      for (uint32_t i = 0; i < 3; ++i) {
        ASSERT_TRUE(*store->addKeyframe(idOf(robot, i), 1'500'000'000 + 100 * int64_t(i), std::vector<uint8_t>(1000)));
        const Pose pose(Eigen::Quaterniond::Identity(), {0.1 * i, robot == "alpha" ? 0.0 : 1.0, 0});
        ASSERT_TRUE(store->setPoses(map, {{idOf(robot, i), pose}}));
        if (i == 0) continue;
        ASSERT_TRUE(store->addEdge({idOf(robot, i - 1), idOf(robot, i), EdgeKind::kOdometry, {}, {}}));
      }
      Surfel surfel;
      surfel.position = {0.3f, 0.2f, 1.1f};
      surfel.radius = 0.01f;
      surfel.confidence = 7;
      surfel.colour = {10, 20, 30};
      for (const Tile& tile : buildTiles(map, std::vector<Surfel>(2, surfel), {})) {
        if (maps == 2 || robot == "alpha") tiles.push_back(tile);
      }
    }
    ASSERT_TRUE(store->setTiles(tiles));
    ASSERT_TRUE(store->addEdge({idOf("alpha", 0), idOf("bravo", 1), EdgeKind::kInterRobot, {}, {}}));
    MatchVerdict verdict;
    verdict.query = idOf("bravo", 1);
    verdict.candidate = idOf("alpha", 0);
    verdict.accepted = true;
    verdict.reason = "accepted";
    verdict.inlier_ratio = 0.875;
    ASSERT_TRUE(store->addVerdict(verdict));
    verdict.accepted = false;
    verdict.reason = "round_trip";
    ASSERT_TRUE(store->addVerdict(verdict));
    ASSERT_TRUE(store->addVerdict(verdict));
    ASSERT_TRUE(store->addMerge({1, "alpha-5-0", "bravo-5-0", {}, {"alpha", "bravo"}, {idOf("bravo", 1)}, 6, {}}));
  }

  Outcome fleet(const std::string& arguments) {
    CLI::App app("fleet");
    int code = 0;
    addInfoVerb(app, code);
    addMatchesVerb(app, code);
    addMergesVerb(app, code);
    addExportVerb(app, code);
    addRenderVerb(app, code);
    addDoctorVerb(app, code);
    addRecoverVerb(app, code);
    addSplitVerb(app, code);
    addForgetVerb(app, code);
    addFinishVerb(app, code);
    ::testing::internal::CaptureStdout();
    ::testing::internal::CaptureStderr();
    try {
      app.parse(arguments);
    } catch (const CLI::ParseError& error) {
      code = app.exit(error) == 0 ? 0 : 2;
    }
    std::fflush(stdout);
    const std::string out = ::testing::internal::GetCapturedStdout();
    return {code, out, ::testing::internal::GetCapturedStderr()};
  }
  std::set<std::string> entries() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_)) {
      names.insert(std::filesystem::relative(entry.path(), folder_).string());
    }
    return names;
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
  const std::string store_ = (folder_ / "map.comap").string();
};

}  // namespace comap
