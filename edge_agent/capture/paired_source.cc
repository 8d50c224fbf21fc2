#include "edge_agent/capture/paired_source.h"

#include <spdlog/fmt/fmt.h>

#include "edge_agent/capture/device_clock.h"
#include "edge_agent/capture/frame_maker.h"
#include "edge_agent/capture/heat_rule.h"
#include "edge_agent/capture/pair_matcher.h"
#include "edge_agent/capture/rate_rule.h"
#include "edge_agent/capture/stream_period.h"

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kTurn{100};
constexpr std::chrono::seconds kTellPeriod{10}, kHeatPeriod{2};

int64_t unixMinusMonotonic_ns() {
  const auto unix_ns =
      std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch());
  return unix_ns.count() - monotonicNow_ns();
}

class PairedSource final : public FrameSource {
 public:
  PairedSource(std::unique_ptr<PictureStream> colour, StreamOpener open_colour, std::unique_ptr<PictureStream> depth,
               StreamOpener open_depth, PairedOptions options)
      : options_(std::move(options)),
        description_("camera: colour " + colour->description() + "; depth " + depth->description()),
        clock_offset_ns_(unixMinusMonotonic_ns()),
        matcher_(options_.max_gap_ns),
        maker_(options_.rig, options_.depth_is_registered, options_.shrink),
        heat_(options_.hot_C),
        colour_(PictureKind::kColour, std::move(colour), std::move(open_colour), inbox_, options_.stream),
        depth_(PictureKind::kDepth, std::move(depth), std::move(open_depth), inbox_, options_.stream) {}

  bool live() const override { return true; }
  size_t size() const override { return 0; }
  std::string description() const override { return description_; }

  bool ready(std::chrono::milliseconds timeout) override {
    workEnds();
    const auto until = Clock::now() + timeout;
    while (true) {
      collect();
      if (pair_) return true;
      if (!inbox_.waitForNews(until)) {
        collect();  // what came without a bell in between
        return pair_.has_value();
      }
    }
  }

  Result<std::optional<Frame>> next() override {
    while (!ready(kTurn)) {
    }
    const PicturePair pair = std::move(*pair_);
    pair_.reset();
    last_ns_ = pair.colour.stamp_ns;
    work_since_ = Clock::now();
    auto frame = maker_.make(pair);
    if (!frame) {
      ++not_decoded_;
      return frame.error();
    }
    frame->stamp_ns += clock_offset_ns_;
    return std::optional<Frame>(std::move(*frame));
  }

  std::optional<CaptureHealth> health() const override {
    CaptureHealth health{inbox_.health(PictureKind::kColour), inbox_.health(PictureKind::kDepth)};
    health.overtaken = matcher_.overtaken() + not_due_ + inbox_.pushedOut(PictureKind::kColour);
    health.unpaired = matcher_.unpaired();
    health.not_decoded = not_decoded_;
    health.every = rate_.every();
    health.hottest_C = hottest_C_;
    return health;
  }

 private:
  void collect() {
    for (Picture& picture : inbox_.take(PictureKind::kColour)) {
      colour_period_.add(picture.stamp_ns);
      matcher_.addColour(std::move(picture));
    }
    for (Picture& picture : inbox_.take(PictureKind::kDepth)) matcher_.addDepth(std::move(picture));
    while (auto newer = matcher_.takeNewest()) {
      if (last_ns_ != 0 && !rate_.due(newer->colour.stamp_ns, last_ns_)) {
        ++not_due_;
        continue;
      }
      if (pair_) ++not_due_;
      pair_ = std::move(newer);
    }
    tellChanges();
  }

  // All from taking a frame until the next one is asked for is work on it.
  void workEnds() {
    if (!work_since_) return;
    const auto work = std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now() - *work_since_);
    work_since_.reset();
    const int before = rate_.every();
    rate_.worked(work.count(), colour_period_.period_ns());
    if (rate_.every() != before && options_.log)
      options_.log("camera: one of " + std::to_string(rate_.every()) + " frames is taken, so that work keeps up");
    lookAtHeat();
  }

  void lookAtHeat() {
    const auto now = Clock::now();
    if (options_.hot_C <= 0 || (heat_seen_ && now - *heat_seen_ < kHeatPeriod)) return;
    heat_seen_ = now;
    hottest_C_ = hottest_C(options_.thermal_folder);
    if (!hottest_C_ && !heat_unknown_told_ && options_.log)
      options_.log("camera: no temperature is told in " + options_.thermal_folder +
                   " (camera.thermal_folder): camera.hot_celsius has no effect");
    heat_unknown_told_ = heat_unknown_told_ || !hottest_C_;
    const int before = heat_.every();
    heat_.measured(hottest_C_, now);
    rate_.setLeast(heat_.every());
    if (heat_.every() != before && options_.log)
      options_.log(
          fmt::format("camera: the machine is {:.0f} C warm (camera.hot_celsius: {:g}): one of {} frames is taken",
                      *hottest_C_, options_.hot_C, rate_.every()));
  }

  void tellChanges() {
    tellChange("colour", inbox_.health(PictureKind::kColour), told_colour_);
    tellChange("depth", inbox_.health(PictureKind::kDepth), told_depth_);
    if (!options_.log || Clock::now() - last_told_ < kTellPeriod) return;
    last_told_ = Clock::now();
    const CaptureHealth now = *health();
    const uint64_t left_out = now.overtaken + now.unpaired + now.not_decoded + now.colour.damaged + now.colour.missed +
                              now.depth.damaged + now.depth.missed;
    if (left_out != left_out_told_) options_.log("camera: " + toString(now));
    left_out_told_ = left_out;
  }

  // That a stream has begun is no news; that it goes on after it was gone is, also if it was never seen streaming.
  void tellChange(const char* name, const StreamHealth& now, StreamState& told) {
    if (now.state == told || now.state == StreamState::kStarting) return;
    const bool begins = told == StreamState::kStarting && now.state == StreamState::kStreaming;
    told = now.state;
    if (begins || !options_.log) return;
    std::string line = std::string("camera: ") + name + " " + toString(now.state);
    if (now.state == StreamState::kGone) line += ", it is waited for: " + now.problem;
    options_.log(line);
  }

  PairedOptions options_;
  std::string description_;
  int64_t clock_offset_ns_;
  PairMatcher matcher_;
  FrameMaker maker_;
  RateRule rate_;
  HeatRule heat_;
  std::optional<double> hottest_C_;
  std::optional<Clock::time_point> heat_seen_;
  bool heat_unknown_told_ = false;
  std::optional<PicturePair> pair_;  // the next one
  std::optional<Clock::time_point> work_since_;
  int64_t last_ns_ = 0;  // of the frame taken last
  StreamPeriod colour_period_;
  uint64_t not_due_ = 0, not_decoded_ = 0;
  StreamState told_colour_ = StreamState::kStarting, told_depth_ = StreamState::kStarting;
  Clock::time_point last_told_ = Clock::now();
  uint64_t left_out_told_ = 0;
  PictureInbox inbox_;
  LiveStream colour_, depth_;  // last: they use the inbox
};

}  // namespace

Result<std::unique_ptr<FrameSource>> openPaired(StreamOpener colour, StreamOpener depth, PairedOptions options) {
  const auto known = [](const Lens& lens) {
    return lens.pinhole.fx > 0 && lens.pinhole.fy > 0 && lens.pinhole.width > 0 && lens.pinhole.height > 0;
  };
  const bool colour_known = known(options.rig.colour);
  const bool depth_known = options.depth_is_registered || known(options.rig.depth);
  if (!colour_known || !depth_known)
    return Error{ErrorCode::kWrongUse,
                 fmt::format("the focal lengths of the {} camera are not known: give camera.profile, or {}{}{}, in the "
                             "configuration",
                             colour_known  ? "depth"
                             : depth_known ? "colour"
                                           : "colour and the depth",
                             colour_known ? "" : "camera.colour.fx and fy", colour_known || depth_known ? "" : " and ",
                             depth_known ? "" : "camera.depth.fx and fy")};
  auto colour_stream = colour();
  if (!colour_stream) return colour_stream.error();
  auto depth_stream = depth();
  if (!depth_stream) return depth_stream.error();
  return std::unique_ptr<FrameSource>(std::make_unique<PairedSource>(
      std::move(*colour_stream), std::move(colour), std::move(*depth_stream), std::move(depth), std::move(options)));
}

}  // namespace comap
