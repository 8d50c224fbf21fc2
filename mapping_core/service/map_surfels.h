// The surfels of all maps, and where each keyframe stood when it was fused into its map's.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <span>

#include "mapping_core/surfels/surfel_map.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/result.h"

namespace comap {

/// Poses of the keyframes of one map.
using MapPoses = std::map<KeyframeId, Pose>;

/// Half: from pictures of half the size, so fewer and larger surfels in a third of the time.
enum class FusionDetail : uint8_t { kFull, kHalf };

/// Maps are named by their anchors. Thread rule: one thread. Errors are the device's and the loader's.
class MapSurfels {
 public:
  using Loader = std::function<Result<Keyframe>(const KeyframeId&)>;
  /// Surfels follow their keyframes when one of them has been moved by `move_m`.
  MapSurfels(gpu::Device& device, const FusionParameters& fusion, double move_m, Loader load)
      : device_(device), fusion_(fusion), move_m_(move_m), load_(std::move(load)) {}

  /// Makes a keyframe known: `index` = its number, `robot` = its robot's, both in order of arrival.
  void know(const KeyframeId& id, uint32_t index, uint32_t robot) { keyframes_[id] = {index, robot, {}, {}}; }
  /// A new map without surfels.
  Result<void> begin(const KeyframeId& anchor);
  /// Fuses a known keyframe into a map.
  Result<void> fuse(const Keyframe& keyframe, const KeyframeId& anchor, const Pose& T_map_cam,
                    FusionDetail detail = FusionDetail::kFull);
  /// Moves the surfels of a map after its keyframes, if that is worth it. True if it was.
  Result<bool> follow(const KeyframeId& anchor, const MapPoses& T_map_cam);
  /// One map takes in another, which is no more.
  Result<void> join(const KeyframeId& kept, const KeyframeId& absorbed, const Pose& T_kept_absorbed);
  /// Throws away the surfels of all maps that hold one of these keyframes; they are fused anew, into the maps given
  /// (anchor -> poses) and in order of their ids, by catchUp().
  Result<void> layOut(const std::map<KeyframeId, MapPoses>& maps);
  /// Fuses up to `keyframes` of those that wait. True if none is left.
  Result<bool> catchUp(size_t keyframes);
  bool caughtUp() const { return unfused_.empty(); }
  size_t waiting() const { return unfused_.size(); }

  /// Whether a map has keyframes that were fused in half detail.
  bool coarse() const { return !coarse_.empty(); }
  /// Fuses up to `keyframes` of such a map once more, in full detail and beside it, which goes on to be what it is.
  /// Once it has all, it takes the coarse one's place: returns its anchor then. Begins anew if the map was joined or
  /// laid out meanwhile; what was fused into it or moved is followed. After an error the map stays coarse until
  /// rebuild().
  Result<std::optional<KeyframeId>> renewCoarse(size_t keyframes);

  /// Fuses every map anew, in full detail, one of whose keyframes stands elsewhere than where it was fused, or was
  /// fused in half detail, or that was moved or joined since: the map as a function of keyframes and poses.
  /// `T_map_cam`: of all keyframes; `progress` (may be empty) hears (done, all) keyframes.
  Result<void> rebuild(const MapPoses& T_map_cam, const std::function<void(size_t, size_t)>& progress);

  SurfelMap& at(const KeyframeId& anchor) { return maps_.at(anchor); }
  /// Surfels of a map; 0 if there is none of this name.
  size_t sizeOf(const KeyframeId& anchor) const {
    const auto map = maps_.find(anchor);
    return map == maps_.end() ? 0 : map->second.size();
  }
  size_t bytes() const;  ///< that all take on the device

 private:
  struct Known {
    uint32_t index = 0, robot = 0;
    KeyframeId anchor;  // of the map that it was fused into, or is to be
    Pose T_map_cam;     // as its surfels have it
  };

  struct Renewal {
    KeyframeId anchor;
    SurfelMap map;
    std::deque<KeyframeId> left;
    MapPoses T_map_cam;  // as its surfels have it
  };
  void beginRenewal(const KeyframeId& anchor);
  Result<void> renew(size_t keyframes);
  void takeRenewed();
  void dropRenewalOf(const KeyframeId& anchor);
  Result<void> fuseInto(SurfelMap& map, const Keyframe& keyframe, const Pose& T_map_cam);

  gpu::Device& device_;
  FusionParameters fusion_;
  double move_m_;
  Loader load_;
  std::map<KeyframeId, Known> keyframes_;
  std::shared_ptr<SurfelPool> pool_;  // made with the first map; the maps share its memory
  std::map<KeyframeId, SurfelMap> maps_;
  std::set<KeyframeId> stale_;      // maps whose surfels were moved since they were fused, or are coarse
  std::set<KeyframeId> coarse_;     // maps of which a keyframe was fused in half detail
  std::optional<Renewal> renewal_;  // of one of them
  std::deque<KeyframeId> unfused_;  // have a map and a pose, but their surfels were thrown away
};

/// How far a change of pose carries what its camera sees, 2 m away; metres.
double displacement(const Pose& T_new, const Pose& T_old);

}  // namespace comap
