#include "mapping_core/service/map_builder.h"

#include <algorithm>
#include <utility>

#include "mapping_core/ferns/fern_encoder.h"
#include "protocol/codec/keyframe_codec.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
MapBuilder::MapBuilder(gpu::Device& device, MapStore& store, const MapBuilderOptions& options)
    : store_(store),
      options_(options),
      surfels_(device, options.fusion, options.move_m, [this](const KeyframeId& id) { return load(id); }),
      book_(FernBook::standard(options.fern_seed)),
      search_(options.search),
      votes_(options.vote),
      asked_(options.asked),
      verifier_(options.verifier),
      shelf_([this](const KeyframeId& id) { return load(id); }, options.cached_views, options.verifier.depth_max_m,
             options.verifier.noise),
      watch_(shelf_, options.merge_check, options.covisibility, options.probation, options.vote) {}

Result<MapChange> MapBuilder::addKeyframe(const Keyframe& keyframe, uint32_t robot_index, Pace pace) {
  if (auto fused = catchUp(surfels_.waiting()); !fused) return fused.error();
  // What a keyframe causes is stored as a whole: after a sudden end it is either mapped or still to be mapped. So
  // nobody has to wait for the disk; the keyframe itself is on it.
  auto transaction = store_.begin(Durable::kWithNext);
  if (!transaction) return transaction.error();
  MapChange change;
  if (std::exchange(recast_due_, false))
    if (auto cast = castAll(change); !cast) return cast.error();
  if (auto placed = place(keyframe, robot_index); !placed) return placed.error();
  const auto code = codeOf(keyframe);
  if (!code) return code.error();
  {
    const StageSpan span("view");
    shelf_.put(keyframe);
  }
  // Matching comes before fusion, so that a loop is verified against what was there before this keyframe.
  const auto verdicts = match(keyframe, *code, pace);
  if (!verdicts) return verdicts.error();
  const KeyframeId placed_in = components_.anchorOf(keyframe.id);
  const FusionDetail detail = pace == Pace::kThorough ? FusionDetail::kFull : FusionDetail::kHalf;
  if (auto fused = surfels_.fuse(keyframe, placed_in, T_map_cam_.at(keyframe.id), detail); !fused) return fused.error();
  if (pace != Pace::kHasty)
    if (auto tied = tieLive(keyframe.id); !tied) return tied.error();
  if (!search_.add(keyframe.id, *code))
    return Error{ErrorCode::kBadData, "keyframe " + toString(keyframe.id) + ": fern code has not the book's size"};
  if (auto taken = take(*verdicts, change); !taken) return taken.error();
  if (auto judged = judgeMerges(keyframe.id, change); !judged) return judged.error();
  const KeyframeId anchor = components_.anchorOf(keyframe.id);
  change.map = mapIdOf(anchor);
  const StageSpan span("store");
  if (auto stored = storeChanged(keyframe.id, change); !stored) return stored.error();
  if (auto committed = transaction->commit(); !committed) return committed.error();
  return change;
}

Result<void> MapBuilder::place(const Keyframe& keyframe, uint32_t robot_index) {
  const auto index = static_cast<uint32_t>(by_index_.size());
  index_[keyframe.id] = index;
  surfels_.know(keyframe.id, index, robot_index);
  by_index_.push_back(keyframe.id);
  KeyframeId previous = keyframe.id;
  previous.sequence = keyframe.linked_to;
  if (!keyframe.linked || !index_.contains(previous)) {
    components_.addAlone(keyframe.id);
    T_map_cam_[keyframe.id] = Pose();
    return surfels_.begin(keyframe.id);
  }
  components_.addTo(keyframe.id, previous);
  watch_.follow(keyframe.id, previous);
  T_map_cam_[keyframe.id] = T_map_cam_.at(previous) * keyframe.T_link_this;
  edges_.push_back({previous, keyframe.id, EdgeKind::kOdometry, keyframe.T_link_this, keyframe.information});
  if (const auto graph = graphs_.find(components_.anchorOf(previous)); graph != graphs_.end())
    if (auto added = graph->second->addKeyframe(keyframe.id, T_map_cam_.at(keyframe.id), previous); !added)
      return added;
  if (auto added = addToGraph(edges_.back()); !added) return added;
  return store_.addEdge(edges_.back());
}

Result<std::optional<KeyframeId>> MapBuilder::renewCoarse(size_t keyframes) {
  auto renewed = surfels_.renewCoarse(keyframes);
  if (!renewed || !*renewed) return renewed;
  if (auto moved = surfels_.follow(**renewed, posesOf(**renewed)); !moved) return moved.error();
  return renewed;
}

std::vector<TilePlace> MapBuilder::placesOf(const KeyframeId& anchor) const {
  std::vector<TilePlace> places;
  for (const KeyframeId& id : components_.members(anchor))
    if (const FernCode* code = search_.code(id)) places.push_back({T_map_cam_.at(id), *code});
  return places;
}

Result<void> MapBuilder::storePoses() {
  for (const KeyframeId& anchor : components_.anchors()) {
    const std::map<KeyframeId, Pose> poses = posesOf(anchor);
    if (auto stored = store_.setPoses(mapIdOf(anchor), poses); !stored) return stored;
    for (const auto& [id, T] : poses) T_map_stored_[id] = T;
  }
  return {};
}

// A robot whose book was set wrong is refused, but what it has kept comes once it is set right; and a core may be given
// another book than its store was made with. The pictures are here, whatever book the code was made with.
Result<FernCode> MapBuilder::codeOf(const Keyframe& keyframe) const {
  if (keyframe.fern_code.book_hash == book_.hash() && keyframe.fern_code.codes.size() == book_.ferns().size())
    return keyframe.fern_code;
  if (!keyframe.colour.empty()) return encodeFerns(book_, keyframe.colour, keyframe.depth);
  const auto whole = load(keyframe.id);
  if (!whole) return whole.error();
  return encodeFerns(book_, whole->colour, whole->depth);
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
