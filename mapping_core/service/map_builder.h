// The one owner of what the fleet has mapped: keyframes, poses, edges, maps and their surfels. Each keyframe goes
// through it once: pose from odometry, fusion, place search, verification, vote, merge, graph.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "mapping_core/ferns/place_index.h"
#include "mapping_core/graph/keyframe_graph.h"
#include "mapping_core/merge/component.h"
#include "mapping_core/store/map_store.h"
#include "mapping_core/surfels/surfel_map.h"
#include "mapping_core/verify/match_verifier.h"
#include "mapping_core/verify/merge_check.h"
#include "mapping_core/verify/vote.h"

namespace comap {

struct MapBuilderOptions {
  FusionParameters fusion;
  VerifierOptions verifier;
  VoteOptions vote;
  MergeCheckOptions merge_check;
  GraphOptions graph;
  size_t candidates = 3;            ///< per keyframe in other maps
  size_t loop_candidates = 2;       ///< per keyframe in its own map
  double max_dissimilarity = 0.45;  ///< of a fern candidate
  uint32_t loop_gap = 20;           ///< keyframes of one robot nearer in sequence are neighbours, not loops
  size_t cached_views = 128;
  double move_m = 0.002;  ///< pose changes below leave the surfels alone
};

/// What one keyframe caused.
struct MapChange {
  MapId map;
  std::vector<MatchVerdict> verdicts;
  std::vector<MergeRecord> merges;
  bool poses_changed = false;  ///< of keyframes that were there before
};

/// Thread rule: one thread. Keyframes, edges, verdicts and merges are in the store before a call returns; poses that
/// the graph moved by less than `move_m` only after storePoses().
class MapBuilder {
 public:
  MapBuilder(gpu::Device& device, MapStore& store, const MapBuilderOptions& options);

  /// Takes in one keyframe. `robot_index` = position of its robot in order of first arrival.
  Result<MapChange> addKeyframe(const Keyframe& keyframe, uint32_t robot_index);

  /// Fuses every map anew whose keyframes have moved, in the order of their ids: the map as a function of keyframes
  /// and poses. `progress` (may be empty) hears (done, all) keyframes.
  Result<void> rebuild(const std::function<void(size_t, size_t)>& progress);
  /// Writes all poses to the store: the graph moves keyframes by less than is worth writing at once.
  Result<void> storePoses();

  const ComponentSet& components() const { return components_; }
  const std::map<KeyframeId, Pose>& poses() const { return T_map_cam_; }
  /// The surfels of the map anchored at `anchor`.
  SurfelMap& surfels(const KeyframeId& anchor) { return maps_.at(anchor); }

 private:
  struct Entry {
    uint32_t index = 0;  // in order of arrival: owner of surfels, place of the fern index
    uint32_t robot = 0;
  };

  Result<void> place(const Keyframe& keyframe, const Entry& entry);
  Result<void> fuse(const Keyframe& keyframe, const Entry& entry);
  Result<std::vector<MatchVerdict>> match(const Keyframe& keyframe);
  Result<void> connect(const MatchVerdict& verdict, MapChange& change);
  Result<Evidence> weighMerge(const std::vector<Closure>& closures);
  Result<std::vector<PlacedSketch>> sketchesOf(const KeyframeId& anchor);
  Result<MergeRecord> merge(const std::vector<Closure>& closures);
  Result<void> addEdge(const Closure& closure);
  Result<bool> optimise(const KeyframeId& anchor);
  Result<std::shared_ptr<const KeyframeView>> viewOf(const KeyframeId& id);
  Result<Keyframe> load(const KeyframeId& id) const;
  std::map<KeyframeId, Pose> posesOf(const KeyframeId& anchor) const;

  gpu::Device& device_;
  MapStore& store_;
  MapBuilderOptions options_;
  std::map<KeyframeId, Entry> entries_;
  std::vector<KeyframeId> by_index_;
  std::map<KeyframeId, Pose> T_map_cam_;    // current estimate
  std::map<KeyframeId, Pose> T_map_fused_;  // where the keyframe's surfels stand now
  std::vector<Edge> edges_;
  ComponentSet components_;
  std::map<KeyframeId, SurfelMap> maps_;  // by anchor
  std::set<KeyframeId> stale_;            // anchors of maps whose surfels were moved since they were fused
  PlaceIndex places_;
  VoteBox votes_;
  MatchVerifier verifier_;
  KeyframeViewCache views_;
  std::map<KeyframeId, Sketch> sketches_;  // of keyframes seen since the start; others are made when asked for
  uint32_t merges_ = 0;
};

}  // namespace comap
