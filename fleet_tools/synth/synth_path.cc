#include "fleet_tools/synth/synth_path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fleet_tools/synth/synth_random.h"

namespace comap {
namespace {

using Eigen::Vector3d;
using Track = Eigen::Matrix<double, 5, 1>;  // x y z, yaw pitch (radians)

constexpr double kPi = 3.14159265358979323846;
constexpr double kSpeed_m_s = 0.46;
constexpr double kTurn_rad_s = 32 * kPi / 180;
constexpr int kSteps = 64;  // per way point, of the time table
constexpr double kGapShare = 0.77;
constexpr int kGapFrames = 200;

// The closed spline; way point i is nearest at u = i.
class Spline {
 public:
  explicit Spline(const std::vector<WayPoint>& loop) {
    for (const auto& p : loop) {
      Track track;
      track << p.x, p.y, p.z, p.yaw_deg * kPi / 180, p.pitch_deg * kPi / 180;
      points_.push_back(track);
    }
    const double closing = points_.front()[3] - points_.back()[3];
    turn_ = points_.back()[3] - points_.front()[3] + std::remainder(closing, 2 * kPi);
  }
  int size() const { return static_cast<int>(points_.size()); }

  Track at(double u) const {
    const double base = std::floor(u);
    const double s = u - base;
    const int i = static_cast<int>(base);
    const double r = 1 - s;
    return (r * r * r * point(i - 1) + (3 * s * s * s - 6 * s * s + 4) * point(i) +
            (3 * r * r * r - 6 * r * r + 4) * point(i + 1) + s * s * s * point(i + 2)) /
           6;
  }

 private:
  Track point(int i) const {
    const int lap = i >= 0 ? i / size() : (i + 1) / size() - 1;
    Track track = points_[static_cast<size_t>(i - lap * size())];
    track[3] += lap * turn_;
    return track;
  }
  std::vector<Track> points_;
  double turn_ = 0;
};

std::vector<double> filtered(const std::vector<double>& values, int reach, bool maximum) {
  const int count = static_cast<int>(values.size());
  std::vector<double> result(values.size());
  for (int i = 0; i < count; ++i) {
    double sum = 0, most = 0;
    for (int k = -reach; k <= reach; ++k) {
      const double value = values[static_cast<size_t>(((i + k) % count + count) % count)];
      sum += value;
      most = std::max(most, value);
    }
    result[static_cast<size_t>(i)] = maximum ? most : sum / (2 * reach + 1);
  }
  return result;
}

// Time at which the walk is at u = i / kSteps, for one round.
std::vector<double> timeTable(const Spline& spline) {
  const int count = spline.size() * kSteps;
  std::vector<double> needed(static_cast<size_t>(count));
  for (int i = 0; i < count; ++i) {
    const Track a = spline.at(static_cast<double>(i) / kSteps), b = spline.at(static_cast<double>(i + 1) / kSteps);
    const double moved = (b - a).head<3>().norm(), turned = (b - a).tail<2>().norm();
    needed[static_cast<size_t>(i)] = std::max(moved / kSpeed_m_s, turned / kTurn_rad_s);
  }
  // The mean over a window of maxima over the same window is never below the value itself, so no limit is broken.
  constexpr int kReach = kSteps / 3;
  needed = filtered(filtered(needed, kReach, true), kReach, false);
  std::vector<double> time{0};
  for (const double step : needed) time.push_back(time.back() + step);
  return time;
}

double parameterAt(const std::vector<double>& time, double t) {
  const double period = time.back();
  const double lap = std::floor(t / period);
  const double rest = t - lap * period;
  const auto after = std::upper_bound(time.begin() + 1, time.end() - 1, rest);
  const auto before = after - 1;
  const double s = (rest - *before) / (*after - *before);
  const double steps = static_cast<double>(before - time.begin()) + s;
  return steps / kSteps + lap * static_cast<double>(time.size() - 1) / kSteps;
}

struct Sway {
  double amplitude, rate_hz, phase;
  double at(double t) const { return amplitude * std::sin(2 * kPi * rate_hz * t + phase); }
};

// Slow wander (the robots do not walk in each other's very steps) and the quick wobble of walking.
struct Hand {
  std::array<std::array<Sway, 3>, 5> sways;

  explicit Hand(uint64_t seed) {
    RandomStream random(seed);
    constexpr double kDegree = kPi / 180;
    constexpr double kWander[5] = {0.04, 0.04, 0.02, 2.5 * kDegree, 1.5 * kDegree};
    constexpr double kWobble[5] = {0.004, 0.004, 0.006, 0.30 * kDegree, 0.25 * kDegree};
    for (size_t i = 0; i < 5; ++i) {
      const auto phase = [&] { return static_cast<double>(random.uniform(0, 6.2831853f)); };
      const auto rate = [&](double low, double high) {
        return low + (high - low) * static_cast<double>(random.uniform(0, 1));
      };
      sways[i] = {Sway{kWander[i], rate(0.06, 0.10), phase()}, Sway{kWobble[i], rate(0.9, 1.3), phase()},
                  Sway{0.6 * kWobble[i], rate(1.6, 2.2), phase()}};
    }
  }
  double at(size_t axis, double t) const {
    double sum = 0;
    for (const auto& sway : sways[axis]) sum += sway.at(t);
    return sum;
  }
};

Pose lookingAlong(const Vector3d& position, double yaw, double pitch) {
  const Vector3d forward(std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch));
  const Vector3d right(std::sin(yaw), -std::cos(yaw), 0);
  Eigen::Matrix3d R_world_cam;
  R_world_cam << right, forward.cross(right), forward;
  return {R_world_cam, position};
}

}  // namespace

std::vector<Pose> walkRoute(const Route& route, int frames, uint64_t robot_seed) {
  const Spline spline(route.loop);
  const auto time = timeTable(spline);
  const double gap_s = kGapShare * std::min(frames, kGapFrames) / kSynthRate_hz;
  const double start_s = time[route.anchor * kSteps] + route.gaps * gap_s;
  const Hand hand(robot_seed);
  std::vector<Pose> poses;
  for (int i = 0; i < frames; ++i) {
    const double t = i / kSynthRate_hz;
    Track track = spline.at(parameterAt(time, start_s + t));
    for (size_t axis = 0; axis < 5; ++axis) track[static_cast<int>(axis)] += hand.at(axis, t);
    poses.push_back(lookingAlong(track.head<3>(), track[3], track[4]));
  }
  return poses;
}

}  // namespace comap
