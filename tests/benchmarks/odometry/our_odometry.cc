#include "tests/benchmarks/odometry/our_odometry.h"

#include <cstdio>

#include "tests/benchmarks/odometry/clocks.h"

namespace comap {
namespace {

class Part {
 public:
  Part(OurOdometry::Probe* probe, const char* name) : probe_(probe) {
    if (probe_ != nullptr) probe_->begin(name);
  }
  ~Part() {
    if (probe_ != nullptr) probe_->end();
  }
  Part(const Part&) = delete;
  Part& operator=(const Part&) = delete;

 private:
  OurOdometry::Probe* probe_;
};

std::string noteOf(const Alignment& a, std::string_view reason) {
  char text[160];
  std::snprintf(text, sizeof text, "inl %.2f rms %.2f deg %.1e photo %.1f gain %.2f it %d ov %.2f %.*s", a.inlier_ratio,
                a.rms_sigma, a.degeneracy, a.photometric_median, a.gain, a.iterations, a.overlap,
                static_cast<int>(reason.size()), reason.data());
  return text;
}

}  // namespace

Step OurOdometry::step(const Frame& frame) {
  Step step;
  const double cpu = processCpu_ms(), wall = wall_ms();
  TrackedFrame tracked;
  {
    const Part part(probe_, "track");
    tracked = odometry_.track(frame);
  }
  std::string_view reason;
  {
    const Part part(probe_, "decide");
    reason = keyframeReason(tracked, ++frames_since_keyframe_, medianDepth(frame.depth), keyframe_options_);
  }
  if (!reason.empty()) {
    const Part part(probe_, "keyframe");
    odometry_.makeKeyframe(tracked);
    frames_since_keyframe_ = 0;
  } else {
    const Part part(probe_, "average");
    odometry_.addToKeyframe(tracked);
  }
  step.cpu_ms = processCpu_ms() - cpu;
  step.wall_ms = wall_ms() - wall;
  step.state = tracked.state;
  step.T_odom_cam = tracked.T_odom_cam;
  step.keyframe = !reason.empty();
  step.note = noteOf(tracked.alignment, reason);
  return step;
}

}  // namespace comap
