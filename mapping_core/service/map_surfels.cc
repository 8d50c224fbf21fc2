#include "mapping_core/service/map_surfels.h"

#include <algorithm>

#include "mapping_core/service/half_keyframe.h"
#include "mapping_core/surfels/surfel_pool.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
namespace {

bool equal(const Pose& a, const Pose& b) {
  return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
}

}  // namespace

double displacement(const Pose& T_new, const Pose& T_old) {
  const Pose change = T_new * T_old.inverse();
  const Eigen::Vector3d seen = T_old * Eigen::Vector3d(0, 0, 2);
  return std::max((change * T_old.translation() - T_old.translation()).norm(), (change * seen - seen).norm());
}

size_t MapSurfels::bytes() const { return pool_ ? pool_->bytes() : 0; }

Result<void> MapSurfels::begin(const KeyframeId& anchor) {
  if (!pool_) {
    auto pool = SurfelPool::create(device_, size_t{fusion_.memory_mb} << 20);
    if (!pool) return pool.error();
    pool_ = std::move(*pool);
  }
  maps_.erase(anchor);
  maps_.emplace(anchor, SurfelMap(pool_, fusion_));
  return {};
}

Result<void> MapSurfels::fuse(const Keyframe& keyframe, const KeyframeId& anchor, const Pose& T_map_cam,
                              FusionDetail detail) {
  const bool half = detail == FusionDetail::kHalf;
  if (half) {
    stale_.insert(anchor);
    coarse_.insert(anchor);
  }
  if (auto fused = fuseInto(maps_.at(anchor), half ? halved(keyframe) : keyframe, T_map_cam); !fused) return fused;
  Known& known = keyframes_.at(keyframe.id);
  known.anchor = anchor;
  known.T_map_cam = T_map_cam;
  if (renewal_ && renewal_->anchor == anchor) renewal_->left.push_back(keyframe.id);
  return {};
}

Result<void> MapSurfels::fuseInto(SurfelMap& map, const Keyframe& keyframe, const Pose& T_map_cam) {
  const StageSpan span("fuse");
  const Known& known = keyframes_.at(keyframe.id);
  const uint32_t contributor = 1u << (known.robot % 32);
  const auto report = map.fuse(keyframe.camera, keyframe.colour, keyframe.depth, T_map_cam, known.index, contributor,
                               keyframe.depth_hits);
  if (!report) return report.error();
  return {};
}

Result<bool> MapSurfels::follow(const KeyframeId& anchor, const MapPoses& T_map_cam) {
  double largest = 0;
  for (const auto& [id, T] : T_map_cam) largest = std::max(largest, displacement(T, keyframes_.at(id).T_map_cam));
  if (largest > 0) stale_.insert(anchor);
  if (largest < move_m_) return false;
  std::vector<Pose> T_new_old(keyframes_.size());
  for (const auto& [id, T] : T_map_cam) {
    Known& known = keyframes_.at(id);
    T_new_old[known.index] = T * known.T_map_cam.inverse();
    known.T_map_cam = T;
  }
  if (auto moved = maps_.at(anchor).moveOwners(T_new_old); !moved) return moved.error();
  return true;
}

Result<void> MapSurfels::join(const KeyframeId& kept, const KeyframeId& absorbed, const Pose& T_kept_absorbed) {
  if (auto moved = maps_.at(kept).absorb(maps_.at(absorbed), T_kept_absorbed); !moved) return moved;
  maps_.erase(absorbed);
  dropRenewalOf(kept);
  dropRenewalOf(absorbed);
  if (coarse_.erase(absorbed) > 0) coarse_.insert(kept);
  stale_.erase(absorbed);
  stale_.insert(kept);  // two maps laid into each other are not yet the map of all their keyframes
  for (auto& [id, known] : keyframes_) {
    if (known.anchor != absorbed) continue;
    known.anchor = kept;
    known.T_map_cam = T_kept_absorbed * known.T_map_cam;
  }
  return {};
}

Result<void> MapSurfels::layOut(const std::map<KeyframeId, MapPoses>& maps) {
  for (const auto& [anchor, poses] : maps)
    for (const auto& [id, T] : poses) {
      Known& known = keyframes_.at(id);
      maps_.erase(known.anchor);
      stale_.erase(known.anchor);
      coarse_.erase(known.anchor);
      dropRenewalOf(known.anchor);
    }
  std::erase_if(unfused_, [&](const KeyframeId& id) {
    return std::any_of(maps.begin(), maps.end(), [&](const auto& map) { return map.second.contains(id); });
  });
  for (const auto& [anchor, poses] : maps) {
    if (auto begun = begin(anchor); !begun) return begun;
    for (const auto& [id, T] : poses) {
      Known& known = keyframes_.at(id);
      known.anchor = anchor;
      known.T_map_cam = T;
      unfused_.push_back(id);
    }
  }
  return {};
}

Result<bool> MapSurfels::catchUp(size_t keyframes) {
  for (; keyframes > 0 && !unfused_.empty(); --keyframes) {
    const KeyframeId id = unfused_.front();
    const auto keyframe = load_(id);
    if (!keyframe) return keyframe.error();
    const Known known = keyframes_.at(id);
    if (auto fused = fuse(*keyframe, known.anchor, known.T_map_cam); !fused) return fused.error();
    unfused_.pop_front();
  }
  return unfused_.empty();
}

Result<std::optional<KeyframeId>> MapSurfels::renewCoarse(size_t keyframes) {
  if (!renewal_) {
    if (coarse_.empty()) return std::optional<KeyframeId>();
    beginRenewal(*coarse_.begin());
  }
  const KeyframeId anchor = renewal_->anchor;
  if (auto fused = renew(keyframes); !fused) {
    renewal_.reset();
    coarse_.erase(anchor);
    return fused.error();
  }
  if (!renewal_->left.empty()) return std::optional<KeyframeId>();
  takeRenewed();
  return std::optional(anchor);
}

void MapSurfels::beginRenewal(const KeyframeId& anchor) {
  renewal_.emplace(Renewal{anchor, SurfelMap(pool_, fusion_), {}, {}});
  for (const auto& [id, known] : keyframes_)
    if (known.anchor == anchor) renewal_->left.push_back(id);
}

Result<void> MapSurfels::renew(size_t keyframes) {
  for (; keyframes > 0 && !renewal_->left.empty(); --keyframes) {
    const KeyframeId id = renewal_->left.front();
    const auto keyframe = load_(id);
    if (!keyframe) return keyframe.error();
    const Pose T_map_cam = keyframes_.at(id).T_map_cam;
    if (auto fused = fuseInto(renewal_->map, *keyframe, T_map_cam); !fused) return fused;
    renewal_->T_map_cam[id] = T_map_cam;
    renewal_->left.pop_front();
  }
  return {};
}

// Its keyframes may have moved since they were fused: follow() sees it by the poses that they were fused at.
void MapSurfels::takeRenewed() {
  maps_.insert_or_assign(renewal_->anchor, std::move(renewal_->map));
  for (const auto& [id, T] : renewal_->T_map_cam) keyframes_.at(id).T_map_cam = T;
  coarse_.erase(renewal_->anchor);
  renewal_.reset();
}

void MapSurfels::dropRenewalOf(const KeyframeId& anchor) {
  if (renewal_ && renewal_->anchor == anchor) renewal_.reset();
}

Result<void> MapSurfels::rebuild(const MapPoses& T_map_cam, const std::function<void(size_t, size_t)>& progress) {
  for (const KeyframeId& id : unfused_) stale_.insert(keyframes_.at(id).anchor);
  unfused_.clear();
  renewal_.reset();
  coarse_.clear();  // all of them are stale, too
  for (const auto& [id, known] : keyframes_)
    if (!equal(known.T_map_cam, T_map_cam.at(id))) stale_.insert(known.anchor);
  std::map<KeyframeId, std::vector<KeyframeId>> members;
  size_t all = 0, done = 0;
  for (const auto& [id, known] : keyframes_) {
    if (!stale_.contains(known.anchor)) continue;
    members[known.anchor].push_back(id);
    ++all;
  }
  for (const auto& [anchor, ids] : members) {
    maps_.at(anchor).clear();
    for (const KeyframeId& id : ids) {
      const auto keyframe = load_(id);
      if (!keyframe) return keyframe.error();
      if (auto fused = fuse(*keyframe, anchor, T_map_cam.at(id)); !fused) return fused.error();
      if (progress) progress(++done, all);
    }
    stale_.erase(anchor);
  }
  return {};
}

}  // namespace comap
