#include "mapping_core/merge/component.h"

#include <algorithm>
#include <cassert>
#include <functional>
#include <set>

namespace comap {

size_t ComponentSet::Hash::operator()(const KeyframeId& id) const {
  constexpr uint64_t kSpread = 0x9e3779b97f4a7c15ull;
  const uint64_t chain = (std::hash<std::string>()(id.robot) ^ id.session) * kSpread;
  return (chain ^ chain >> 32 ^ id.sequence) * kSpread;
}

void ComponentSet::addAlone(const KeyframeId& keyframe) {
  const auto [position, added] = index_.emplace(keyframe, keyframes_.size());
  if (!added) return;
  keyframes_.push_back(keyframe);
  parent_.push_back(parent_.size());
  anchor_of_root_.push_back(keyframe);
}

void ComponentSet::addTo(const KeyframeId& keyframe, const KeyframeId& neighbour) {
  assert(contains(neighbour));
  if (contains(keyframe)) return;
  const size_t root = rootOf(index_.at(neighbour));
  addAlone(keyframe);
  parent_.back() = root;
}

std::optional<std::pair<KeyframeId, KeyframeId>> ComponentSet::join(const KeyframeId& a, const KeyframeId& b) {
  assert(contains(a) && contains(b));
  size_t kept = rootOf(index_.at(a));
  size_t absorbed = rootOf(index_.at(b));
  if (kept == absorbed) return std::nullopt;
  if (anchor_of_root_[absorbed] < anchor_of_root_[kept]) std::swap(kept, absorbed);
  parent_[absorbed] = kept;
  return std::pair{anchor_of_root_[kept], anchor_of_root_[absorbed]};
}

bool ComponentSet::contains(const KeyframeId& keyframe) const { return index_.contains(keyframe); }

KeyframeId ComponentSet::anchorOf(const KeyframeId& keyframe) const {
  assert(contains(keyframe));
  return anchor_of_root_[rootOf(index_.at(keyframe))];
}

bool ComponentSet::together(const KeyframeId& a, const KeyframeId& b) const {
  assert(contains(a) && contains(b));
  return rootOf(index_.at(a)) == rootOf(index_.at(b));
}

std::vector<KeyframeId> ComponentSet::anchors() const {
  std::vector<KeyframeId> result;
  for (size_t i = 0; i < parent_.size(); ++i) {
    if (parent_[i] == i) result.push_back(anchor_of_root_[i]);
  }
  std::sort(result.begin(), result.end());
  return result;
}

std::vector<KeyframeId> ComponentSet::members(const KeyframeId& anchor) const {
  std::vector<KeyframeId> result;
  const auto found = index_.find(anchor);
  if (found == index_.end()) return result;
  const size_t root = rootOf(found->second);
  for (size_t i = 0; i < keyframes_.size(); ++i) {
    if (rootOf(i) == root) result.push_back(keyframes_[i]);
  }
  return result;
}

std::vector<std::string> ComponentSet::robots(const KeyframeId& anchor) const {
  std::set<std::string> names;
  for (const KeyframeId& member : members(anchor)) names.insert(member.robot);
  return {names.begin(), names.end()};
}

size_t ComponentSet::rootOf(size_t index) const {
  while (parent_[index] != index) {
    parent_[index] = parent_[parent_[index]];
    index = parent_[index];
  }
  return index;
}

}  // namespace comap
