#include "edge_agent/map_cache/map_localizer.h"

#include <algorithm>

namespace comap {
namespace {

constexpr size_t kMostMarks = 4096;
constexpr size_t kBytesPerMb = size_t{1} << 20;
constexpr double kInsist_m = 0.03, kInsist_rad = 0.02;  // registrations that agree with each other

bool agree(const Pose& a, const Pose& b, double distance_m, double angle_rad) {
  const Pose between = a.inverse() * b;
  return between.translation().norm() < distance_m && between.angle() < angle_rad;
}

// Refusals that say that this is another place, and not that too little of it is known or in view.
bool contradicts(const std::string& reason) {
  return reason == "inlier_ratio" || reason == "rms_sigma" || reason == "photometric" || reason == "seen_through" ||
         reason == "depth_disagrees" || reason == "unlike" || reason == "round_trip";
}

}  // namespace

MapLocalizer::MapLocalizer(const LocalizerOptions& options)
    : options_(options),
      cache_(static_cast<size_t>(options.memory_mb) * kBytesPerMb),
      filter_(options.filter),
      registration_(options.registration),
      search_(options.search) {}

void MapLocalizer::track(const Pyramid& live, const Pose& T_odom_cam, bool aligned) {
  T_odom_cam_ = T_odom_cam;
  filter_.move(T_odom_cam, !aligned);
  ++frames_;
  ++frames_since_;
  const bool placed = state_ == MapState::kPlaced || state_ == MapState::kRecognised;
  if (options_.enabled && placed && aligned && frames_since_ >= options_.every_frames) {
    frames_since_ = 0;
    registerFrame(live);
  }
  smooth();
}

void MapLocalizer::registerFrame(const Pyramid& live) {
  if (cache_.tiles().empty()) return;
  ++statistics_.attempts;
  const Pose T_map_guess = filter_.T_map_cam();
  const bool strict = state_ == MapState::kRecognised;
  const Registration found =
      strict ? registration_.verify(cache_, live, T_map_guess) : registration_.near(cache_, live, T_map_guess);
  if (!found.accepted) {
    ++statistics_.refused[found.reason];
    insisted_ = 0;
    if (strict && contradicts(found.reason)) doubt();
    return;
  }
  doubts_ = 0;
  if (!filter_.measure(found.T_map_cam, found.information)) {
    ++statistics_.refused["unexpected"];
    insist(live, found);
    return;
  }
  insisted_ = 0;
  noteRegistered(T_map_guess);
}

void MapLocalizer::noteRegistered(const Pose& T_map_before) {
  ++statistics_.registered;
  const Pose moved = T_map_before.inverse() * filter_.T_map_cam();
  statistics_.corrected_m_sum += moved.translation().norm();
  statistics_.corrected_m_worst = std::max(statistics_.corrected_m_worst, moved.translation().norm());
  statistics_.corrected_rad_worst = std::max(statistics_.corrected_rad_worst, moved.angle());
}

// Several registrations that agree with each other know better than a filter that has been too sure of itself.
void MapLocalizer::insist(const Pyramid& live, const Registration& found) {
  const Pose T_map_expected = T_map_odom_insisted_ * T_odom_cam_;
  insisted_ = insisted_ > 0 && agree(T_map_expected, found.T_map_cam, kInsist_m, kInsist_rad) ? insisted_ + 1 : 1;
  T_map_odom_insisted_ = found.T_map_cam * T_odom_cam_.inverse();
  if (insisted_ < options_.insist || !registration_.verify(cache_, live, found.T_map_cam).accepted) return;
  const Pose T_map_before = filter_.T_map_cam();
  filter_.set(T_map_odom_insisted_, {});
  insisted_ = 0;
  noteRegistered(T_map_before);
}

// A place that was recognised turns out to be another one that looked like it.
void MapLocalizer::doubt() {
  if (++doubts_ < options_.doubts) return;
  doubts_ = 0;
  state_ = MapState::kAstray;
  ++statistics_.taken_back;
  search_.reset();
}

bool MapLocalizer::searches(bool lost) const {
  return options_.enabled && !cache_.tiles().empty() &&
         (state_ == MapState::kAstray || (lost && state_ != MapState::kUnplaced));
}

bool MapLocalizer::search(const Pyramid& live, const FernCode& code, const Pose& T_odom_cam) {
  if (!search_.pending() && ++frames_unsearched_ < options_.search_every_frames) return false;
  frames_unsearched_ = 0;
  ++statistics_.searched;
  const Pose T_map_guess = filter_.T_map_odom() * T_odom_cam;
  if (!search_.attempt(cache_, registration_, live, code, T_odom_cam, T_map_guess)) {
    if (!search_.place().accepted) ++statistics_.not_found[search_.place().reason];
    return false;
  }
  hold(search_.place().T_map_cam * T_odom_cam.inverse(), T_odom_cam);
  return true;
}

// What is known of the places of other chains is in frames of their own.
void MapLocalizer::recognise(uint32_t keyframe, const Pose& T_odom_cam) {
  const bool of_this_chain = state_ == MapState::kPlaced       ? keyframe >= tied_from_
                             : state_ == MapState::kRecognised ? keyframe >= chain_start_
                                                               : false;
  if (of_this_chain) hold(filter_.T_map_odom(), T_odom_cam);
}

void MapLocalizer::hold(const Pose& T_map_odom, const Pose& T_odom_cam) {
  state_ = MapState::kRecognised;
  recognised_at_ = frames_ + 1;
  doubts_ = 0;
  frames_since_ = -1;  // this frame has just been aligned
  ++statistics_.recognised;
  filter_.move(T_odom_cam, false);
  filter_.set(T_map_odom, {});
}

void MapLocalizer::keyframeMade(uint32_t sequence, const MapId& chain) {
  marks_.emplace_back(sequence, filter_.odometer());
  if (marks_.size() > kMostMarks) marks_.pop_front();
  if (chain.empty()) {
    if (chain_start_ && sequence - *chain_start_ >= options_.astray_keyframes && state_ == MapState::kAstray &&
        own_chain_)
      follow(Correction(*own_chain_), sequence);
    return;
  }
  if (state_ == MapState::kUnplaced) return;
  chain_ = chain;
  chain_start_ = sequence;
  own_chain_.reset();
  if (recognised_at_ != frames_) state_ = MapState::kAstray;
}

void MapLocalizer::correct(const Correction& correction, uint32_t mapped_below) {
  if (chain_start_) {
    if (correction.map == chain_) {  // not yet joined with what this robot knows
      own_chain_ = correction;
      if (!options_.enabled || cache_.tiles().empty()) follow(correction, mapped_below);
      return;
    }
    if (mapped_below <= *chain_start_) return;  // about the chain before, whose place is lost
  }
  follow(correction, mapped_below);
}

void MapLocalizer::follow(const Correction& correction, uint32_t keyframe) {
  const bool here = cache_.map() == correction.map && options_.enabled &&
                    (state_ == MapState::kPlaced || state_ == MapState::kRecognised);
  if (here) {
    filter_.correct(correction.T_map_odom, since(keyframe));
  } else {
    filter_.set(correction.T_map_odom, since(keyframe));
  }
  cache_.setMap(correction.map);
  state_ = MapState::kPlaced;
  tied_from_ = chain_start_.value_or(tied_from_);
  chain_start_.reset();
  own_chain_.reset();
  search_.reset();
  frames_since_ = options_.every_frames;  // what is right shows at the next frame
}

Odometer MapLocalizer::since(uint32_t keyframe) const {
  const auto mark = std::find_if(marks_.begin(), marks_.end(), [&](const auto& one) { return one.first >= keyframe; });
  return mark == marks_.end() ? Odometer{} : between(mark->second, filter_.odometer());
}

// Each frame a share of what is left, so that those who steer by the pose see no jumps; what is far is another place.
void MapLocalizer::smooth() {
  const Pose T_map_shown = T_map_odom_smooth_ * T_odom_cam_;
  const Vector6d left = (T_map_shown.inverse() * filter_.T_map_cam()).log();
  const bool jumps = cache_.map() != smooth_map_ || left.head<3>().norm() > options_.jump_m ||
                     left.tail<3>().norm() > options_.jump_rad;
  smooth_map_ = cache_.map();
  T_map_odom_smooth_ =
      jumps ? filter_.T_map_odom() : T_map_shown * Pose::exp(left / options_.smooth_frames) * T_odom_cam_.inverse();
}

LivePose MapLocalizer::live() const {
  LivePose pose;
  pose.state = state_;
  pose.map = cache_.map();
  pose.covariance = filter_.covariance();
  pose.hypothesis = believed();
  if (state_ == MapState::kAstray || state_ == MapState::kRecognised) {
    pose.map = own_chain_ ? own_chain_->map : MapId();
    if (own_chain_) pose.T_map_odom = pose.T_map_odom_exact = own_chain_->T_map_odom;
  } else {
    pose.T_map_odom = T_map_odom_smooth_;
    pose.T_map_odom_exact = filter_.T_map_odom();
  }
  pose.T_map_cam = pose.T_map_odom * T_odom_cam_;
  pose.T_map_cam_exact = pose.T_map_odom_exact * T_odom_cam_;
  return pose;
}

std::optional<MapPose> MapLocalizer::believed() const {
  if (state_ != MapState::kRecognised) return {};
  return MapPose{cache_.map(), filter_.T_map_odom() * T_odom_cam_};
}

std::optional<MapPose> MapLocalizer::interestAt() const {
  if (!options_.enabled || (state_ != MapState::kRecognised && state_ != MapState::kAstray)) return {};
  return MapPose{cache_.map(), filter_.T_map_odom() * T_odom_cam_};
}

double MapLocalizer::interestRadius(double radius_m) {
  cache_.stayNear(filter_.T_map_cam().translation(), radius_m);
  return cache_.reach_m();
}

}  // namespace comap
