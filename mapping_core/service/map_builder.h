// The one owner of what the fleet has mapped: keyframes, poses, edges, maps and their surfels. Each keyframe goes
// through it once: pose from odometry, fusion, place search, verification, vote, merge, graph.
#pragma once

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "mapping_core/ferns/fern_book.h"
#include "mapping_core/graph/graph_solver.h"
#include "mapping_core/merge/standing.h"
#include "mapping_core/service/map_surfels.h"
#include "mapping_core/service/merge_watch.h"
#include "mapping_core/store/map_store.h"
#include "mapping_core/verify/asked_places.h"
#include "mapping_core/verify/candidate_search.h"
#include "mapping_core/verify/covisibility.h"
#include "mapping_core/verify/keyframe_shelf.h"
#include "mapping_core/verify/match_verifier.h"
#include "mapping_core/verify/merge_check.h"
#include "mapping_core/verify/vote.h"

namespace comap {

/// What time a keyframe is worth. Brisk: it is fused in half detail, which rebuild() makes up for. Hasty: besides, only
/// other maps are searched for its place; its own map by askNext(), which also ties it there.
enum class Pace : uint8_t { kThorough, kBrisk, kHasty };

struct MapBuilderOptions {
  uint32_t fern_seed = FernBook::kStandardSeed;  ///< of the book of all robots and of this map
  FusionParameters fusion;
  VerifierOptions verifier;
  VoteOptions vote;
  MergeCheckOptions merge_check;
  ProbationOptions probation;
  CovisibilityOptions covisibility;
  size_t live_ties = 3;  ///< covisibility edges that a keyframe gets when it comes; the others by refine()
  int refine_rounds = 2;
  /// A closure is measured once, from where the map then was, and the ties around it measure the same surface again.
  GraphOptions graph{.closure_sigma = 3};
  SearchOptions search;
  AskedPlacesOptions asked;
  size_t cached_views = 40;  ///< ready for matching; 1.4 MB each at 640x480
  double move_m = 0.002;     ///< pose changes below leave the surfels alone
};

/// What one keyframe caused.
struct MapChange {
  MapId map;
  std::vector<MatchVerdict> verdicts;
  std::vector<MergeRecord> merges;
  std::vector<MergeRecord> undone;      ///< merges that were taken back
  std::vector<Confirmation> confirmed;  ///< merges that are beyond doubt now
  bool poses_changed = false;           ///< of keyframes that were there before
};

/// Thread rule: one thread. What a call changes of keyframes, edges, verdicts and merges is in the store before it
/// returns, all of it or nothing; poses that the graph moved by less than `move_m` only after storePoses().
class MapBuilder {
 public:
  MapBuilder(gpu::Device& device, MapStore& store, const MapBuilderOptions& options);

  /// Takes over what an earlier core has mapped into the store: keyframes, edges, merges, votes, places; poses as
  /// settle() gives them. Call it first, on a builder that holds nothing. Surfels are fused anew by catchUp(); then
  /// this builder is what that core was when it had finished. kBadData if a stored record cannot be.
  Result<void> restore();

  /// Casts all votes that wait anew, in the order of their verdicts: after keyframes of others were taken out, they may
  /// be what joins two maps. Surfels of maps that change are fused by rebuild().
  Result<MapChange> recast();
  /// Whether that is due: the store says so, or a merge was taken back. addKeyframe() begins with it.
  bool recastDue() const { return recast_due_; }

  /// Takes in one keyframe. `robot_index` = position of its robot in order of first arrival.
  Result<MapChange> addKeyframe(const Keyframe& keyframe, uint32_t robot_index, Pace pace = Pace::kThorough);

  /// Whether addKeyframe() in a hurry has put off ties and questions.
  bool hasUnasked() const { return !unasked_.empty(); }
  /// Ties one keyframe, the oldest, that was not tied in a hurry, and asks what it was not asked: only keyframes that
  /// came before it, as it would have been then. What a core has put off is lost if it is killed; refine() ties all.
  Result<MapChange> askNext();

  /// Takes a merge back: its closures are withdrawn, and with them every edge that ties what it had tied; the maps
  /// come apart and have the poses they would have without it. The withdrawn edges stay in the store and never join
  /// these maps again unless rejoin() is called. Surfels of the parts are fused anew by catchUp().
  /// kWrongUse if there is no such merge, it is undone already, or `reason` is empty.
  Result<MapChange> split(uint32_t merge, const std::string& reason);
  /// Takes a split() back. kWrongUse if the merge is not undone, was undone with another, or its maps were joined
  /// otherwise since.
  Result<MapChange> rejoin(uint32_t merge);

  /// Fuses up to `keyframes` of those whose surfels are missing since a split or restore. True if none is left.
  /// addKeyframe() begins with the rest of them.
  Result<bool> catchUp(size_t keyframes) { return surfels_.catchUp(keyframes); }
  bool caughtUp() const { return surfels_.caughtUp(); }
  size_t unfused() const { return surfels_.waiting(); }
  /// Whether a map has keyframes in half detail; gives it full detail, `keyframes` at a time: see
  /// MapSurfels::renewCoarse(), which says what is returned. For a core that has nothing else to do.
  bool coarse() const { return surfels_.coarse(); }
  Result<std::optional<KeyframeId>> renewCoarse(size_t keyframes);

  /// Computes the poses of all maps anew, as a pure function of the stored edges and merges: not of the order in which
  /// they came. Call before rebuild() and storePoses() at the end.
  Result<void> settle();

  /// Forgets all ties, here and in the store: they were measured from poses that had a history.
  Result<void> untie();

  /// Ties all keyframes of each map that see the same surface, measures these ties anew where the map has moved them,
  /// and optimises: a few rounds come near to a joint optimum over all pictures. Call before settle(). `progress`
  /// (may be empty) hears (done, all) keyframes.
  Result<void> refine(const std::function<void(size_t, size_t)>& progress);

  /// Fuses every map anew whose keyframes have moved, in the order of their ids: the map as a function of keyframes
  /// and poses. `progress` (may be empty) hears (done, all) keyframes.
  Result<void> rebuild(const std::function<void(size_t, size_t)>& progress) {
    return surfels_.rebuild(T_map_cam_, progress);
  }
  /// Writes all poses to the store: the graph moves keyframes by less than is worth writing at once.
  Result<void> storePoses();

  /// Merges that are still on probation.
  std::vector<Confirmation> onProbation() const { return watch_.open(); }
  const ComponentSet& components() const { return components_; }
  const std::map<KeyframeId, Pose>& poses() const { return T_map_cam_; }
  /// The views that the map anchored at `anchor` was made from, in order of their names.
  std::vector<TilePlace> placesOf(const KeyframeId& anchor) const;
  /// The surfels of the map anchored at `anchor`.
  SurfelMap& surfels(const KeyframeId& anchor) { return surfels_.at(anchor); }
  size_t surfelCount(const KeyframeId& anchor) const { return surfels_.sizeOf(anchor); }
  /// What all surfels take on the device.
  size_t surfelBytes() const { return surfels_.bytes(); }

 private:
  // A map's poses as the graph has them, and the merges none of whose closures it can agree with.
  struct SolvedMap {
    std::map<KeyframeId, Pose> T_map_cam;
    std::vector<uint32_t> overruled;
  };

  // Where another map may lie in one that is to be joined with a third.
  struct Rival {
    KeyframeId anchor;
    Pose T_map_other;
  };

  Result<void> place(const Keyframe& keyframe, uint32_t robot_index);
  Result<std::vector<MatchVerdict>> match(const Keyframe& keyframe, const FernCode& code, Pace pace);
  std::vector<Candidate> candidatesOf(const Keyframe& keyframe, const FernCode& code, Pace pace) const;
  Result<std::vector<MatchVerdict>> askAll(const KeyframeId& id, const std::optional<MapPose>& believed,
                                           std::span<const Candidate> candidates, std::vector<KeyframeId> known);
  Result<MatchVerdict> ask(const KeyframeView& query, const std::optional<MapPose>& believed,
                           const Candidate& candidate);
  Result<void> take(std::span<const MatchVerdict> verdicts, MapChange& change);
  std::vector<std::pair<KeyframeId, Pose>> othersIn(const MapId& map, const KeyframeId& id) const;
  Result<void> connect(const MatchVerdict& verdict, MapChange& change);
  Result<void> propose(const MatchVerdict& verdict, MapChange& change);
  Result<void> close(const Closure& closure, MapChange& change);
  void doomOverruled(const SolvedMap& solved);
  Result<double> weighMerge(const std::vector<Closure>& closures);
  std::vector<Rival> alternatives(const KeyframeId& anchor, const KeyframeId& joined) const;
  Result<bool> hasRival(const std::vector<Closure>& closures);
  Result<std::vector<uint32_t>> partedBetween(const KeyframeId& a, const KeyframeId& b) const;
  Result<std::vector<PlacedSketch>> sketchesOf(const KeyframeId& anchor);
  Result<MergeRecord> merge(const std::vector<Closure>& closures);
  Result<void> castAll(MapChange& change);
  Result<void> judgeMerges(const std::optional<KeyframeId>& newest, MapChange& change);
  Result<void> undo(uint32_t merge, const std::string& reason, MapChange& change);
  Result<void> watch(const MergeRecord& merge);
  Result<void> watchStanding();
  Result<void> refreshWatch();

  Result<void> tieLive(const KeyframeId& id);
  Result<void> tie(const KeyframeId& id, size_t most, std::span<const PlacedSketch> members);
  void indexTies();
  Result<void> tieAnew(const KeyframeId& from, const KeyframeId& to);
  Result<GraphSolver*> graphOf(const KeyframeId& anchor);
  Result<void> addToGraph(const Edge& edge);
  Result<SolvedMap> solve(const KeyframeId& anchor);
  Result<bool> apply(const KeyframeId& anchor, const std::map<KeyframeId, Pose>& T_map_cam);
  Result<bool> solveWhole(const KeyframeId& anchor);
  Result<void> storeChanged(const KeyframeId& id, const MapChange& change);
  Result<void> storeMoved(const KeyframeId& anchor);
  Result<FernCode> codeOf(const Keyframe& keyframe) const;
  Result<Keyframe> load(const KeyframeId& id) const;
  std::map<KeyframeId, Pose> posesOf(const KeyframeId& anchor) const;
  Result<Standing> readStanding() const;
  Result<void> restoreVotes();
  Result<void> reshape(Standing standing, const std::set<KeyframeId>& changed);

  MapStore& store_;
  MapBuilderOptions options_;
  std::map<KeyframeId, uint32_t> index_;  // in order of arrival
  std::vector<KeyframeId> by_index_;
  std::map<KeyframeId, Pose> T_map_cam_;     // current estimate
  std::map<KeyframeId, Pose> T_map_stored_;  // what the store has; only what moved is written again
  std::vector<Edge> edges_;
  std::map<KeyframeId, std::unique_ptr<GraphSolver>> graphs_;  // by anchor; those missing are made from edges_
  ComponentSet components_;
  MapSurfels surfels_;
  FernBook book_;
  CandidateSearch search_;
  VoteBox votes_;
  AskedPlaces asked_;
  MatchVerifier verifier_;
  KeyframeShelf shelf_;
  MergeWatch watch_;
  std::vector<Objection> doomed_;  // merges that the graph contradicts, until judgeMerges() undoes them
  struct Unasked {
    KeyframeId id;
    std::vector<KeyframeId> asked;  // what it was asked about at once
  };
  std::deque<Unasked> unasked_;  // that were mapped in a hurry
  bool recast_due_ = false;      // votes wait for a map that came apart
  PointResiduals tie_workspace_;
  // Ties that were tried, and the relative pose from which: places in edges_ if they held.
  struct Tie {
    Pose T_from_to;
    std::optional<size_t> edge;
    EdgeKind kind = EdgeKind::kCovisibility;
  };
  std::map<std::pair<KeyframeId, KeyframeId>, Tie> ties_;
  size_t indexed_edges_ = 0;
  uint32_t merges_ = 0;
};

}  // namespace comap
