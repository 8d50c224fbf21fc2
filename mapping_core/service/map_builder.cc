#include "mapping_core/service/map_builder.h"

#include <algorithm>
#include <cmath>

#include "mapping_core/merge/map_merger.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

// How far a pose change carries what its camera sees, 2 m away.
double displacement(const Pose& T_new, const Pose& T_old) {
  const Pose change = T_new * T_old.inverse();
  const Eigen::Vector3d seen = T_old * Eigen::Vector3d(0, 0, 2);
  return std::max((change * T_old.translation() - T_old.translation()).norm(), (change * seen - seen).norm());
}

void transformSurfels(const Pose& T, std::vector<Surfel>& surfels) {
  const Eigen::Matrix3f r = T.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T.translation().cast<float>();
  for (Surfel& surfel : surfels) {
    surfel.position = r * surfel.position + t;
    surfel.normal = r * surfel.normal;
  }
}

}  // namespace

MapBuilder::MapBuilder(gpu::Device& device, MapStore& store, const MapBuilderOptions& options)
    : device_(device),
      store_(store),
      options_(options),
      votes_(options.vote),
      verifier_(options.verifier),
      views_(options.cached_views) {}

Result<MapChange> MapBuilder::addKeyframe(const Keyframe& keyframe, uint32_t robot_index) {
  if (auto fused = catchUp(unfused_.size()); !fused) return fused.error();
  // What a keyframe causes is stored as a whole: after a sudden end it is either mapped or still to be mapped.
  auto transaction = store_.begin();
  if (!transaction) return transaction.error();
  const Entry entry{static_cast<uint32_t>(by_index_.size()), robot_index};
  if (auto placed = place(keyframe, entry); !placed) return placed.error();
  auto view = makeKeyframeView(keyframe, options_.verifier.depth_max_m, options_.verifier.noise);
  sketches_.emplace(keyframe.id, makeSketch(keyframe, view->pyramid, options_.verifier.noise));
  views_.insert(std::move(view));

  MapChange change;
  // Matching comes before fusion, so that a loop is verified against what was there before this keyframe.
  auto verdicts = match(keyframe);
  if (!verdicts) return verdicts.error();
  change.verdicts = std::move(*verdicts);
  if (auto fused = fuse(keyframe, entry); !fused) return fused.error();
  if (options_.live_ties > 0) {
    auto members = sketchesOf(components_.anchorOf(keyframe.id));
    if (!members) return members.error();
    indexTies();
    if (auto tied = tie(keyframe.id, options_.live_ties, *members); !tied) return tied.error();
  }
  if (!places_.add(entry.index, keyframe.fern_code))
    return Error{ErrorCode::kBadData, "keyframe " + toString(keyframe.id) + ": fern code is of another book"};
  const std::vector<MatchVerdict> judged = change.verdicts;  // connecting may add refusals
  for (const MatchVerdict& verdict : judged) {
    if (auto stored = store_.addVerdict(verdict); !stored) return stored.error();
    if (!verdict.accepted) continue;
    if (auto connected = connect(verdict, change); !connected) return connected.error();
  }
  const KeyframeId anchor = components_.anchorOf(keyframe.id);
  change.map = mapIdOf(anchor);
  const auto poses =
      change.poses_changed ? posesOf(anchor) : std::map<KeyframeId, Pose>{{keyframe.id, T_map_cam_.at(keyframe.id)}};
  if (auto stored = store_.setPoses(change.map, poses); !stored) return stored.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  return change;
}

Result<void> MapBuilder::place(const Keyframe& keyframe, const Entry& entry) {
  entries_[keyframe.id] = entry;
  by_index_.push_back(keyframe.id);
  KeyframeId previous = keyframe.id;
  previous.sequence = keyframe.linked_to;
  if (!keyframe.linked || !entries_.contains(previous)) {
    components_.addAlone(keyframe.id);
    T_map_cam_[keyframe.id] = Pose();
    auto map = SurfelMap::create(device_, options_.fusion);
    if (!map) return map.error();
    maps_.emplace(keyframe.id, std::move(*map));
    return {};
  }
  components_.addTo(keyframe.id, previous);
  T_map_cam_[keyframe.id] = T_map_cam_.at(previous) * keyframe.T_link_this;
  edges_.push_back({previous, keyframe.id, EdgeKind::kOdometry, keyframe.T_link_this, keyframe.information});
  return store_.addEdge(edges_.back());
}

Result<void> MapBuilder::fuse(const Keyframe& keyframe, const Entry& entry) {
  SurfelMap& map = maps_.at(components_.anchorOf(keyframe.id));
  const Pose& T = T_map_cam_.at(keyframe.id);
  auto report = map.fuse(keyframe.camera, keyframe.colour, keyframe.depth, T, entry.index, 1u << (entry.robot % 32));
  if (!report) return report.error();
  T_map_fused_[keyframe.id] = T;
  return {};
}

Result<std::vector<MatchVerdict>> MapBuilder::match(const Keyframe& keyframe) {
  const auto inOtherMap = [&](uint32_t place) { return !components_.together(by_index_[place], keyframe.id); };
  const auto loop = [&](uint32_t place) {
    const KeyframeId& other = by_index_[place];
    const bool neighbour = other.robot == keyframe.id.robot && other.session == keyframe.id.session &&
                           keyframe.id.sequence - other.sequence < options_.loop_gap;
    return !neighbour && components_.together(other, keyframe.id);
  };
  std::vector<PlaceCandidate> candidates = places_.query(keyframe.fern_code, options_.candidates, inOtherMap);
  for (const PlaceCandidate& candidate : places_.query(keyframe.fern_code, options_.loop_candidates, loop))
    candidates.push_back(candidate);

  std::vector<MatchVerdict> verdicts;
  auto query = viewOf(keyframe.id);
  if (!query) return query.error();
  for (const PlaceCandidate& candidate : candidates) {
    if (candidate.dissimilarity > options_.max_dissimilarity) continue;
    const KeyframeId& id = by_index_[candidate.place];
    auto view = viewOf(id);
    if (!view) return view.error();
    auto verdict = verifier_.verify(**query, **view, maps_.at(components_.anchorOf(id)), T_map_cam_.at(id));
    if (!verdict) return verdict.error();
    verdict->fern_dissimilarity = candidate.dissimilarity;
    verdicts.push_back(std::move(*verdict));
  }
  return verdicts;
}

Result<void> MapBuilder::connect(const MatchVerdict& verdict, MapChange& change) {
  const Closure closure{verdict.query, verdict.candidate, verdict.T_candidate_query, verdict.information};
  if (components_.together(closure.query, closure.candidate)) {
    if (auto added = addEdge(closure); !added) return added.error();
  } else {
    const auto agreed = votes_.cast(
        closure, [this](const auto& a, const auto& b) { return components_.together(a, b); }, T_map_cam_);
    if (!agreed) return {};
    auto evidence = weighMerge(*agreed);
    if (!evidence) return evidence.error();
    if (evidence->contradicted() > options_.merge_check.contradicted) {
      // Its voters are spent: only new views of the two maps can bring the question up again.
      MatchVerdict refusal = verdict;
      refusal.accepted = false;
      refusal.reason = "contradiction";
      refusal.seen_through = evidence->contradicted();
      change.verdicts.push_back(refusal);
      return store_.addVerdict(refusal);
    }
    auto record = merge(*agreed);
    if (!record) return record.error();
    change.merges.push_back(std::move(*record));
    change.poses_changed = true;
  }
  auto moved = optimise(components_.anchorOf(closure.query));
  if (!moved) return moved.error();
  change.poses_changed = change.poses_changed || *moved;
  return {};
}

Result<Evidence> MapBuilder::weighMerge(const std::vector<Closure>& closures) {
  const Pose T_a_b = averageTransform(closures, T_map_cam_);
  auto a = sketchesOf(components_.anchorOf(closures.front().candidate));
  if (!a) return a.error();
  auto b = sketchesOf(components_.anchorOf(closures.front().query));
  if (!b) return b.error();
  return weighHypothesis(*a, *b, T_a_b, options_.merge_check);
}

Result<std::vector<PlacedSketch>> MapBuilder::sketchesOf(const KeyframeId& anchor) {
  std::vector<PlacedSketch> placed;
  for (const KeyframeId& id : components_.members(anchor)) {
    auto it = sketches_.find(id);
    if (it == sketches_.end()) {
      auto keyframe = load(id);
      if (!keyframe) return keyframe.error();
      auto view = viewOf(id);
      if (!view) return view.error();
      it = sketches_.emplace(id, makeSketch(*keyframe, (*view)->pyramid, options_.verifier.noise)).first;
    }
    placed.push_back({&it->second, T_map_cam_.at(id)});
  }
  return placed;
}

Result<void> MapBuilder::addEdge(const Closure& closure, uint32_t merge) {
  const EdgeKind kind = closure.query.robot == closure.candidate.robot ? EdgeKind::kLoop : EdgeKind::kInterRobot;
  edges_.push_back({closure.candidate, closure.query, kind, closure.T_candidate_query, closure.information, merge});
  return store_.addEdge(edges_.back());
}

Result<MergeRecord> MapBuilder::merge(const std::vector<Closure>& closures) {
  const KeyframeId a = components_.anchorOf(closures.front().candidate);
  const KeyframeId b = components_.anchorOf(closures.front().query);
  const Pose T_a_b = averageTransform(closures, T_map_cam_);
  const std::vector<KeyframeId> members_a = components_.members(a), members_b = components_.members(b);
  const KeyframeId kept = components_.join(a, b)->first;
  const bool keeps_a = kept == a;
  const KeyframeId absorbed = keeps_a ? b : a;
  const Pose T_kept_absorbed = keeps_a ? T_a_b : T_a_b.inverse();

  auto surfels = maps_.at(absorbed).download();
  if (!surfels) return surfels.error();
  transformSurfels(T_kept_absorbed, *surfels);
  if (auto appended = maps_.at(kept).append(*surfels); !appended) return appended.error();
  maps_.erase(absorbed);
  stale_.erase(absorbed);
  stale_.insert(kept);  // two maps laid into each other are not yet the map of all their keyframes
  for (const KeyframeId& id : keeps_a ? members_b : members_a) {
    T_map_cam_.at(id) = T_kept_absorbed * T_map_cam_.at(id);
    T_map_fused_.at(id) = T_kept_absorbed * T_map_fused_.at(id);
  }

  MergeRecord record;
  record.number = ++merges_;
  record.kept = mapIdOf(kept);
  record.absorbed = mapIdOf(absorbed);
  record.T_kept_absorbed = T_kept_absorbed;
  record.robots = components_.robots(kept);
  record.keyframes_ingested = static_cast<uint32_t>(by_index_.size());
  for (const Closure& closure : closures) {
    record.voters.push_back(closure.query);
    if (auto added = addEdge(closure, record.number); !added) return added.error();
  }
  if (auto stored = store_.addMerge(record); !stored) return stored.error();
  return record;
}

Result<bool> MapBuilder::optimise(const KeyframeId& anchor) {
  std::vector<Edge> edges;
  for (const Edge& edge : edges_)
    if (components_.together(edge.from, anchor)) edges.push_back(edge);
  auto solution = optimiseGraph(posesOf(anchor), edges, anchor, options_.graph);
  if (!solution) return solution.error();
  for (const auto& [id, T] : solution->T_map_cam) T_map_cam_.at(id) = T;

  double largest = 0;
  for (const auto& [id, T] : solution->T_map_cam) largest = std::max(largest, displacement(T, T_map_fused_.at(id)));
  if (largest > 0) stale_.insert(anchor);
  if (largest < options_.move_m) return false;
  std::vector<Pose> T_new_old(by_index_.size());
  for (const auto& [id, T] : solution->T_map_cam) {
    T_new_old[entries_.at(id).index] = T * T_map_fused_.at(id).inverse();
    T_map_fused_.at(id) = T;
  }
  if (auto moved = maps_.at(anchor).moveOwners(T_new_old); !moved) return moved.error();
  return true;
}

Result<void> MapBuilder::storePoses() {
  for (const KeyframeId& anchor : components_.anchors())
    if (auto stored = store_.setPoses(mapIdOf(anchor), posesOf(anchor)); !stored) return stored;
  return {};
}

Result<void> MapBuilder::rebuild(const std::function<void(size_t, size_t)>& progress) {
  for (const KeyframeId& id : unfused_) stale_.insert(components_.anchorOf(id));
  unfused_.clear();
  size_t all = 0, done = 0;
  for (const KeyframeId& anchor : stale_) all += components_.members(anchor).size();
  while (!stale_.empty()) {
    const KeyframeId anchor = *stale_.begin();
    maps_.at(anchor).clear();
    std::vector<KeyframeId> members = components_.members(anchor);
    std::sort(members.begin(), members.end());
    for (const KeyframeId& id : members) {
      auto keyframe = load(id);
      if (!keyframe) return keyframe.error();
      if (auto fused = fuse(*keyframe, entries_.at(id)); !fused) return fused.error();
      if (progress) progress(++done, all);
    }
    stale_.erase(anchor);
  }
  return {};
}

Result<std::shared_ptr<const KeyframeView>> MapBuilder::viewOf(const KeyframeId& id) {
  if (auto view = views_.find(id)) return view;
  auto keyframe = load(id);
  if (!keyframe) return keyframe.error();
  auto view = makeKeyframeView(*keyframe, options_.verifier.depth_max_m, options_.verifier.noise);
  views_.insert(view);
  return view;
}

Result<Keyframe> MapBuilder::load(const KeyframeId& id) const {
  auto encoded = store_.encodedKeyframe(id);
  if (!encoded) return encoded.error();
  return decodeKeyframe(*encoded);
}

std::map<KeyframeId, Pose> MapBuilder::posesOf(const KeyframeId& anchor) const {
  std::map<KeyframeId, Pose> poses;
  for (const KeyframeId& id : components_.members(anchor)) poses[id] = T_map_cam_.at(id);
  return poses;
}

}  // namespace comap
