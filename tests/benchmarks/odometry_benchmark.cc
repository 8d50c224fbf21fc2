// Speed and drift of the robot's odometry on recorded sequences with truth:
//   odometry_benchmark DIR[@FIRST:LAST] ...
// One line a sequence: ATE RMSE (rigid alignment), relative error over one second, milliseconds a frame.
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <sstream>
#include <vector>

#include "edge_agent/capture/source_uri.h"
#include "edge_agent/keyframes/keyframe_selector.h"
#include "edge_agent/odometry/visual_odometry.h"

namespace comap {
namespace {

std::map<int64_t, Pose> readTruth(const std::string& path) {
  std::map<int64_t, Pose> truth;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream in(line);
    double s, x, y, z, qx, qy, qz, qw;
    if (in >> s >> x >> y >> z >> qx >> qy >> qz >> qw)
      truth[std::llround(s * 1e6)] = Pose(Eigen::Quaterniond(qw, qx, qy, qz), {x, y, z});
  }
  return truth;
}

struct Tracked {
  Pose estimate, truth;
};

double ateRmse(const std::vector<Tracked>& poses) {
  Eigen::Matrix3Xd e(3, poses.size()), t(3, poses.size());
  for (size_t i = 0; i < poses.size(); ++i) {
    e.col(static_cast<long>(i)) = poses[i].estimate.translation();
    t.col(static_cast<long>(i)) = poses[i].truth.translation();
  }
  const Eigen::Matrix4d fit = Eigen::umeyama(e, t, false);
  const Eigen::Matrix3Xd rest = ((fit.topLeftCorner<3, 3>() * e).colwise() + fit.topRightCorner<3, 1>()) - t;
  return std::sqrt(rest.squaredNorm() / static_cast<double>(poses.size()));
}

int run(const std::string& place, bool verbose) {
  auto source = openSource(place);
  const auto folder = parseTumPlace(place);
  if (!source || !folder) {
    std::fprintf(stderr, "odometry_benchmark: %s\n", (!source ? source.error() : folder.error()).text.c_str());
    return 3;
  }
  const auto truth = readTruth(folder->directory + "/groundtruth.txt");
  VisualOdometry odometry{OdometryOptions{}};
  const KeyframeOptions keyframe_options;
  std::vector<Tracked> poses;
  std::vector<double> milliseconds;
  int keyframes = 0, since = 0, poor = 0, frames = 0;
  TrackingState state = TrackingState::kOk;
  for (;;) {
    auto next = (*source)->next();
    if (!next || !*next) break;
    const Frame& frame = **next;
    const auto start = std::chrono::steady_clock::now();
    const TrackedFrame tracked = odometry.track(frame);
    ++since;
    const auto reason = keyframeReason(tracked, since, medianDepth(frame.depth), state, keyframe_options);
    if (!reason.empty()) {
      odometry.makeKeyframe();
      ++keyframes;
      since = 0;
    }
    milliseconds.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    state = tracked.state;
    poor += tracked.state != TrackingState::kOk;
    ++frames;
    auto it = truth.lower_bound(frame.stamp_ns / 1000 - 5000);
    if (it != truth.end() && it->first < frame.stamp_ns / 1000 + 5000)
      poses.push_back({tracked.T_odom_cam, it->second});
    if (verbose)
      std::printf("%4d inl %.2f rms %.2f deg %.1e photo %.1f gain %.2f it %d ov %.2f %s\n", frames - 1,
                  tracked.alignment.inlier_ratio, tracked.alignment.rms_sigma, tracked.alignment.degeneracy,
                  tracked.alignment.photometric_median, tracked.alignment.gain, tracked.alignment.iterations,
                  tracked.alignment.overlap, std::string(reason).c_str());
  }
  if (poses.size() < 3) {
    std::fprintf(stderr, "odometry_benchmark: %s: fewer than 3 frames have a true pose\n", place.c_str());
    return 3;
  }
  std::vector<double> drift_m, drift_deg;
  for (size_t i = 0; i + 30 < poses.size(); ++i) {
    const Pose error = (poses[i].truth.inverse() * poses[i + 30].truth).inverse() *
                       (poses[i].estimate.inverse() * poses[i + 30].estimate);
    drift_m.push_back(error.translation().norm());
    drift_deg.push_back(error.angle() * 180 / M_PI);
  }
  std::sort(milliseconds.begin(), milliseconds.end());
  std::sort(drift_m.begin(), drift_m.end());
  std::sort(drift_deg.begin(), drift_deg.end());
  const auto at = [](const std::vector<double>& v, double q) {
    return v.empty() ? 0.0 : v[std::min(v.size() - 1, static_cast<size_t>(q * static_cast<double>(v.size())))];
  };
  std::printf(
      "%-32s %4d frames %3d keyframes %3d poor | ATE %.4f m | 1 s: median %.4f m %.2f deg, worst %.4f m %.2f deg"
      " | ms median %.1f p95 %.1f worst %.1f\n",
      place.substr(place.size() > 32 ? place.size() - 32 : 0).c_str(), frames, keyframes, poor, ateRmse(poses),
      at(drift_m, 0.5), at(drift_deg, 0.5), at(drift_m, 1), at(drift_deg, 1), at(milliseconds, 0.5),
      at(milliseconds, 0.95), at(milliseconds, 1));
  return 0;
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  bool verbose = false;
  int worst = argc < 2 ? 2 : 0;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    if (argument == "-v") {
      verbose = true;
    } else if (argument == "--help" || argument == "-h") {
      worst = 2;
    } else {
      worst = std::max(worst, comap::run(argument, verbose));
    }
  }
  if (worst == 2)
    std::fprintf(stderr, "usage: odometry_benchmark [-v] DIR[@FIRST:LAST] ...  (TUM folders with groundtruth.txt)\n");
  return worst;
}
