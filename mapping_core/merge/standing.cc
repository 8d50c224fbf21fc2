#include "mapping_core/merge/standing.h"

#include <algorithm>
#include <tuple>

namespace comap {
namespace {

using Sides = std::pair<KeyframeId, KeyframeId>;  // anchors, the smaller first

bool inCanonicalOrder(const Edge& a, const Edge& b) {
  return std::tie(a.to, a.from, a.kind) < std::tie(b.to, b.from, b.kind);
}

// The closures of one merge by the maps they lie between; none of those that lie within one.
std::map<Sides, std::vector<Edge>> closuresBySides(const std::vector<Edge>& closures, const ComponentSet& components) {
  std::map<Sides, std::vector<Edge>> by_sides;
  for (const Edge& closure : closures) {
    const KeyframeId from = components.anchorOf(closure.from), to = components.anchorOf(closure.to);
    if (from != to) by_sides[{std::min(from, to), std::max(from, to)}].push_back(closure);
  }
  return by_sides;
}

// Edges by whether both ends are known, and not by value: they are large.
struct Sorted {
  std::vector<const Edge*> known;  // in canonical order
  std::vector<const Edge*> others;
};

Sorted sortEdges(std::span<const Edge> edges, const ComponentSet& components) {
  Sorted sorted;
  for (const Edge& edge : edges) {
    const bool forward = edge.kind != EdgeKind::kOdometry || edge.from < edge.to;  // whatever a damaged store says
    const bool ends_known = components.contains(edge.from) && components.contains(edge.to);
    (forward && ends_known ? sorted.known : sorted.others).push_back(&edge);
  }
  std::sort(sorted.known.begin(), sorted.known.end(),
            [](const Edge* a, const Edge* b) { return inCanonicalOrder(*a, *b); });
  return sorted;
}

void join(Shape& shape, const std::vector<const Edge*>& known, std::span<const MergeRecord> merges,
          size_t votes_needed) {
  ComponentSet& components = shape.components;
  std::map<uint32_t, std::vector<Edge>> closures_of;
  for (const Edge* edge : known) {
    if (edge->kind == EdgeKind::kOdometry)
      components.join(edge->from, edge->to);
    else if (edge->merge != 0)
      closures_of[edge->merge].push_back(*edge);
  }
  for (const MergeRecord& merge : merges) {
    if (!merge.undone.empty()) continue;
    const std::vector<Edge>& closures = closures_of[merge.number];
    auto by_sides = closuresBySides(closures, components);
    const auto strongest = std::max_element(by_sides.begin(), by_sides.end(), [](const auto& a, const auto& b) {
      return a.second.size() < b.second.size();
    });
    const size_t needed = std::max<size_t>(1, std::min(votes_needed, merge.voters.size()));
    const size_t support = strongest != by_sides.end() ? strongest->second.size() : closures.size();
    if (support < needed) {
      shape.unsupported.push_back(merge.number);
      continue;
    }
    if (strongest == by_sides.end()) continue;  // they lie within one map by now: an edge like others
    components.join(strongest->first.first, strongest->first.second);
    shape.joins.push_back({merge.number, std::move(strongest->second)});
  }
}

}  // namespace

Shape shapeOf(std::span<const KeyframeId> keyframes, std::span<const Edge> edges, std::span<const MergeRecord> merges,
              size_t votes_needed) {
  Shape shape;
  shape.components.reserve(keyframes.size());
  for (const KeyframeId& keyframe : keyframes) shape.components.addAlone(keyframe);
  join(shape, sortEdges(edges, shape.components).known, merges, votes_needed);
  return shape;
}

Standing standingOf(std::span<const KeyframeId> keyframes, std::span<const Edge> edges,
                    std::span<const MergeRecord> merges, size_t votes_needed) {
  Standing standing;
  for (const KeyframeId& keyframe : keyframes) standing.components.addAlone(keyframe);
  const Sorted sorted = sortEdges(edges, standing.components);
  join(standing, sorted.known, merges, votes_needed);
  for (const Edge* edge : sorted.others) standing.apart.push_back(*edge);
  for (const Edge* edge : sorted.known) {
    const bool holds = standing.components.together(edge->from, edge->to);
    (holds ? standing.edges : standing.apart).push_back(*edge);
  }
  return standing;
}

std::optional<std::pair<std::vector<KeyframeId>, std::vector<KeyframeId>>> sidesOf(
    uint32_t merge, std::span<const KeyframeId> keyframes, std::span<const Edge> edges,
    std::span<const MergeRecord> merges, size_t votes_needed) {
  const Shape with = shapeOf(keyframes, edges, merges, votes_needed);
  const auto join =
      std::find_if(with.joins.begin(), with.joins.end(), [&](const Join& one) { return one.merge == merge; });
  if (join == with.joins.end()) return std::nullopt;
  std::vector<MergeRecord> others(merges.begin(), merges.end());
  std::erase_if(others, [&](const MergeRecord& one) { return one.number == merge; });
  const ComponentSet without = shapeOf(keyframes, edges, others, votes_needed).components;
  KeyframeId first = without.anchorOf(join->closures.front().from);
  KeyframeId second = without.anchorOf(join->closures.front().to);
  if (first == second) return std::nullopt;
  if (second < first) std::swap(first, second);
  return std::pair{without.members(first), without.members(second)};
}

}  // namespace comap
