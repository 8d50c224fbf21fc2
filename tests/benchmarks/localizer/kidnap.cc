#include "tests/benchmarks/localizer/kidnap.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <optional>

#include "edge_agent/capture/source_uri.h"
#include "tests/benchmarks/localizer/played_fleet.h"
#include "tests/benchmarks/localizer/spliced_source.h"
#include "tests/benchmarks/localizer/truth.h"

namespace comap {
namespace {

constexpr double kRight_m = 0.10, kRight_deg = 5;

}  // namespace

Result<KidnapOutcome> measureKidnap(gpu::Device& device, const KidnapOptions& options) {
  PlayedFleet fleet(device, [&](const std::string& line) {
    if (options.verbose) std::cerr << line << '\n';
  });
  std::vector<std::unique_ptr<FrameSource>> sources;
  std::optional<Pose> T_world_map;
  for (const std::string& uri : options.mappers) {
    auto source = openSource(uri);
    if (!source) return source.error();
    const auto truth = Truth::of(uri);
    if (!truth) return truth.error();
    if (!T_world_map) {
      auto again = openSource(uri);
      if (!again) return again.error();
      const auto first = (*again)->next();
      if (!first) return first.error();
      const auto pose = truth->at((*first)->stamp_ns);
      if (!pose) return pose.error();
      T_world_map = *pose;
    }
    sources.push_back(std::move(*source));
    const auto robot = fleet.add(std::string(1, static_cast<char>('a' + sources.size() - 1)), *sources.back(), false);
    if (!robot) return robot.error();
    if (auto played = fleet.playAll(**robot); !played) return played.error();
  }
  auto own = openSource(options.own), away = openSource(options.away);
  if (!own) return own.error();
  if (!away) return away.error();
  const auto truth = Truth::of(options.away);
  if (!truth) return truth.error();
  SplicedSource source(std::move(*own), options.covered, std::move(*away));
  const auto robot = fleet.add("robot", source, true);
  if (!robot) return robot.error();
  const Agent& agent = *(*robot)->agent;

  KidnapOutcome outcome;
  MapId map;
  uint32_t relocalised_before = 0;
  std::vector<double> errors;
  for (;;) {
    const auto start = std::chrono::steady_clock::now();
    const auto more = fleet.takeFrame(**robot);
    if (!more) return more.error();
    if (!*more) break;
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    const LivePose live = agent.livePose();
    if (!source.inSecond()) {
      map = live.map;
      relocalised_before = agent.statistics().relocalised;
      if (source.original_ns() < 0 && map.rfind("a-", 0) != 0)
        return Error{ErrorCode::kProblem, options.own + ": the robot was not in the map of " + options.mappers[0]};
    } else {
      ++outcome.frames;
      outcome.search_ms_worst = std::max(outcome.search_ms_worst, took.count());
      // Until it has noticed that it was carried off, it believes to be where it was.
      const bool found_back = agent.statistics().relocalised > relocalised_before;
      if (found_back && outcome.found_back_after < 0) outcome.found_back_after = outcome.frames;
      const bool noticed = found_back || agent.statistics().chains > 1 || live.state != MapState::kPlaced;
      const bool placed = live.map == map && live.state == MapState::kPlaced;
      if (noticed && (placed || live.hypothesis) && agent.tracking() != TrackingState::kLost) {
        const auto T_world_cam = truth->at(source.original_ns());
        if (!T_world_cam) return T_world_cam.error();
        const Pose error = (T_world_map->inverse() * *T_world_cam).inverse() *
                           (placed ? live.T_map_cam_exact : live.hypothesis->T_map_cam);
        const bool right = error.translation().norm() < kRight_m && error.angle() * 180 / M_PI < kRight_deg;
        if (options.verbose)
          std::cerr << "frame " << outcome.frames << " state " << static_cast<int>(live.state) << " error "
                    << error.translation().norm() << " m " << error.angle() * 180 / M_PI << " deg\n";
        if (outcome.recognised_after < 0) outcome.recognised_after = outcome.frames;
        if (placed && outcome.joined_after < 0) outcome.joined_after = outcome.frames;
        if (right) errors.push_back(error.translation().norm());
        if (placed)
          ++(right ? outcome.right : outcome.wrong);
        else
          ++(right ? outcome.hypothesis_right : outcome.hypothesis_wrong);
      }
    }
    if (auto served = fleet.serve(**robot); !served) return served.error();
  }
  outcome.taken_back = static_cast<int>(agent.localizer().statistics().taken_back);
  if (options.verbose) {
    for (const auto& [reason, count] : agent.localizer().statistics().refused)
      std::cerr << "refused " << reason << ": " << count << '\n';
    for (const auto& [reason, count] : agent.localizer().statistics().not_found)
      std::cerr << "not found " << reason << ": " << count << '\n';
  }
  std::sort(errors.begin(), errors.end());
  if (!errors.empty()) outcome.error_m = errors[errors.size() / 2];
  return outcome;
}

}  // namespace comap
