#include "tests/benchmarks/localizer/drift.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <optional>

#include "edge_agent/capture/source_uri.h"
#include "tests/benchmarks/localizer/played_fleet.h"
#include "tests/benchmarks/localizer/truth.h"

namespace comap {
namespace {

// Remembers the stamp of the frame that was last given.
class StampedSource final : public FrameSource {
 public:
  // Gives every `every`-th frame.
  explicit StampedSource(std::unique_ptr<FrameSource> source, int every = 1)
      : source_(std::move(source)), every_(every) {}
  Result<std::optional<Frame>> next() override {
    auto frame = source_->next();
    for (int skipped = 1; skipped < every_ && first_ns >= 0 && frame && *frame; ++skipped) frame = source_->next();
    if (frame && *frame) {
      stamp_ns = (*frame)->stamp_ns;
      if (first_ns < 0) first_ns = stamp_ns;
    }
    return frame;
  }
  size_t size() const override { return source_->size(); }
  std::string description() const override { return source_->description(); }

  int64_t stamp_ns = -1, first_ns = -1;

 private:
  std::unique_ptr<FrameSource> source_;
  int every_;
};

struct Error6 {
  double m, deg;
};

struct Played {
  std::vector<Error6> exact, smooth, odometry;
  LocalizerStatistics statistics;
  TimeHistogram registration_ms;
};

Error6 errorOf(const Pose& T_true, const Pose& T_believed) {
  const Pose error = T_true.inverse() * T_believed;
  return {error.translation().norm(), error.angle() * 180 / M_PI};
}

DriftErrors summary(const std::vector<Error6>& errors) {
  DriftErrors result;
  std::vector<double> metres;
  double square = 0;
  for (const Error6& error : errors) {
    metres.push_back(error.m);
    square += error.m * error.m;
  }
  std::sort(metres.begin(), metres.end());
  result.end_m = errors.back().m;
  result.end_deg = errors.back().deg;
  result.rms_m = std::sqrt(square / static_cast<double>(errors.size()));
  result.median_m = metres[metres.size() / 2];
  result.worst_m = metres.back();
  return result;
}

Result<Played> play(gpu::Device& device, const DriftOptions& options, bool localizer) {
  PlayedFleet fleet(device, [&](const std::string& line) {
    if (options.verbose) std::cerr << line << '\n';
  });
  std::vector<std::unique_ptr<StampedSource>> sources;
  std::optional<Pose> T_world_map;
  MapId map;
  for (const std::string& uri : options.mappers) {
    auto source = openSource(uri);
    if (!source) return source.error();
    const auto truth = Truth::of(uri);
    if (!truth) return truth.error();
    sources.push_back(std::make_unique<StampedSource>(std::move(*source)));
    const auto robot = fleet.add(std::string(1, static_cast<char>('a' + sources.size() - 1)), *sources.back(), false);
    if (!robot) return robot.error();
    if (auto played = fleet.playAll(**robot); !played) return played.error();
    if (T_world_map) continue;
    const auto first = truth->at(sources.back()->first_ns);
    if (!first) return first.error();
    T_world_map = *first;
    map = (*robot)->agent->livePose().map;
  }

  auto source = openSource(options.robot);
  if (!source) return source.error();
  const auto truth = Truth::of(options.robot);
  if (!truth) return truth.error();
  StampedSource stamped(std::move(*source), options.every);
  const auto robot = fleet.add("robot", stamped, localizer);
  if (!robot) return robot.error();
  Played played;
  std::optional<Pose> T_map_odom_frozen;
  int in_map = 0;
  for (int frame = 0;; ++frame) {
    const auto more = fleet.takeFrame(**robot);
    if (!more) return more.error();
    if (!*more) break;
    // The pose of the moment: before the core hears of this frame.
    const LivePose live = (*robot)->agent->livePose();
    if (live.state == MapState::kPlaced && live.map == map) {
      ++in_map;
      const Pose T_odom_cam = (*robot)->agent->odometryPose();
      const bool counts = options.silent_after == 0 || in_map > options.silent_after;
      if (counts) {
        if (!T_map_odom_frozen) T_map_odom_frozen = live.T_map_cam_exact * T_odom_cam.inverse();
        const auto T_world_cam = truth->at(stamped.stamp_ns);
        if (!T_world_cam) return T_world_cam.error();
        const Pose T_true = T_world_map->inverse() * *T_world_cam;
        played.exact.push_back(errorOf(T_true, live.T_map_cam_exact));
        played.smooth.push_back(errorOf(T_true, live.T_map_cam));
        played.odometry.push_back(errorOf(T_true, *T_map_odom_frozen * T_odom_cam));
        if (options.verbose && in_map % 10 == 0)
          std::cerr << "frame " << frame << " error " << played.exact.back().m << " odometry "
                    << played.odometry.back().m << '\n';
      }
    }
    const bool silent = options.silent_after > 0 && in_map > options.silent_after;
    if (!silent && frame % options.answer_every == 0)
      if (auto served = fleet.serve(**robot); !served) return served.error();
  }
  played.statistics = (*robot)->agent->localizer().statistics();
  played.registration_ms = (*robot)->agent->statistics().localizer_ms;
  if (played.exact.empty())
    return Error{ErrorCode::kProblem, options.robot + ": the robot never came into the map of " + options.mappers[0]};
  return played;
}

}  // namespace

Result<DriftOutcome> measureDrift(gpu::Device& device, const DriftOptions& options) {
  const auto with = play(device, options, true);
  if (!with) return with.error();
  const auto without = play(device, options, false);
  if (!without) return without.error();
  DriftOutcome outcome;
  outcome.frames = with->exact.size();
  outcome.with_tiles = summary(with->exact);
  outcome.smooth = summary(with->smooth);
  outcome.without_tiles = summary(without->exact);
  outcome.odometry = summary(without->odometry);
  const LocalizerStatistics& s = with->statistics;
  outcome.registered = s.registered;
  for (const auto& [reason, count] : s.refused) {
    outcome.refused += count;
    if (options.verbose) std::cerr << "refused " << reason << ": " << count << '\n';
  }
  outcome.corrected_m_mean = s.registered > 0 ? s.corrected_m_sum / s.registered : 0;
  outcome.corrected_m_worst = s.corrected_m_worst;
  outcome.registration_ms_median = with->registration_ms.quantile_ms(0.5);
  outcome.registration_ms_p95 = with->registration_ms.quantile_ms(0.95);
  outcome.registration_ms_worst = with->registration_ms.worst_ms();
  return outcome;
}

}  // namespace comap
