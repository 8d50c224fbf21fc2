#include "edge_agent/odometry/place_memory.h"

#include <algorithm>
#include <cmath>

namespace comap {
namespace {

constexpr double kLeastShare = 0.1;  // of the ferns, and of the picture, with depth

bool recognisable(const FernCode& code) {
  const auto bad = std::count(code.codes.begin(), code.codes.end(), FernCode::kBad);
  const double valid = static_cast<double>(code.codes.size()) - static_cast<double>(bad);
  return !code.codes.empty() && valid >= kLeastShare * static_cast<double>(code.codes.size());
}

bool hasDepth(const PyramidLevel& level) {
  const float* begin = level.depth_m.data();
  const auto valid = std::count_if(begin, begin + level.depth_m.size(), [](float d) { return d > 0; });
  return static_cast<double>(valid) >= kLeastShare * static_cast<double>(level.depth_m.size()) && valid > 0;
}

RememberedPlace compress(uint32_t sequence, const Pose& T_odom_keyframe, const FernCode& code,
                         const PyramidLevel& level) {
  const int width = level.grey.width(), height = level.grey.height();
  RememberedPlace place{
      sequence, T_odom_keyframe, code, level.camera, Image<uint8_t>(width, height), Image<uint16_t>(width, height)};
  for (size_t i = 0; i < level.grey.size(); ++i) {
    place.grey.data()[i] = static_cast<uint8_t>(std::clamp(std::lround(level.grey.data()[i]), 0l, 255l));
    const long depth = std::lround(level.depth_m.data()[i] * kDepthUnitsPerMetre);
    place.depth.data()[i] = depth > 0 && depth <= 65535 ? static_cast<uint16_t>(depth) : uint16_t{0};
  }
  return place;
}

}  // namespace

Pyramid RememberedPlace::pyramid() const {
  ColourImage colour(grey.width(), grey.height());
  Image<float> depth_m(grey.width(), grey.height());
  for (size_t i = 0; i < grey.size(); ++i) {
    const uint8_t g = grey.data()[i];
    colour.data()[i] = {g, g, g};
    depth_m.data()[i] = static_cast<float>(depth.data()[i]) * static_cast<float>(1.0 / kDepthUnitsPerMetre);
  }
  Pyramid levels;
  buildPyramid(colour, depth_m, camera, 2, levels);
  levels.insert(levels.begin(), kPlaceLevel, PyramidLevel{});
  return levels;
}

bool PlaceMemory::add(uint32_t sequence, const Pose& T_odom_keyframe, const FernCode& code, const Pyramid& pyramid) {
  if (pyramid.size() < kPlaceLevel + 2 || !recognisable(code) || !hasDepth(pyramid[kPlaceLevel])) return false;
  for (const RememberedPlace& place : places_)
    if (place.sequence == sequence || place.code.book_hash != code.book_hash ||
        place.code.codes.size() != code.codes.size())
      return false;
  places_.push_back(compress(sequence, T_odom_keyframe, code, pyramid[kPlaceLevel]));
  nearest_.emplace_back();
  const size_t added = places_.size() - 1;
  for (size_t i = 0; i < added; ++i) {
    const double d = dissimilarity(places_[i].code, code);
    if (d < nearest_[i].dissimilarity) nearest_[i] = {d, sequence};
    if (d < nearest_[added].dissimilarity) nearest_[added] = {d, places_[i].sequence};
  }
  if (places_.size() <= std::max<size_t>(1, capacity_)) return true;
  const size_t redundant = mostRedundant();
  forget(redundant);
  return redundant != added;
}

std::vector<PlaceCandidate> PlaceMemory::similar(const FernCode& code, size_t count, double max_dissimilarity) const {
  std::vector<PlaceCandidate> candidates;
  for (size_t i = 0; i < places_.size(); ++i) {
    const double d = dissimilarity(places_[i].code, code);
    if (d <= max_dissimilarity && d < 1) candidates.push_back({static_cast<uint32_t>(i), d});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const PlaceCandidate& a, const PlaceCandidate& b) { return a.dissimilarity < b.dissimilarity; });
  if (candidates.size() > count) candidates.resize(count);
  return candidates;
}

void PlaceMemory::clear() {
  places_.clear();
  nearest_.clear();
}

PlaceMemory::Neighbour PlaceMemory::nearestTo(size_t place) const {
  Neighbour nearest;
  for (size_t i = 0; i < places_.size(); ++i) {
    if (i == place) continue;
    const double d = dissimilarity(places_[i].code, places_[place].code);
    if (d < nearest.dissimilarity) nearest = {d, places_[i].sequence};
  }
  return nearest;
}

// Both places of the closest pair have each other's distance: the later of the two in the list is the newer.
size_t PlaceMemory::mostRedundant() const {
  size_t found = 0;
  for (size_t i = 1; i < places_.size(); ++i)
    if (nearest_[i].dissimilarity <= nearest_[found].dissimilarity) found = i;
  return found;
}

void PlaceMemory::forget(size_t place) {
  const uint32_t sequence = places_[place].sequence;
  places_.erase(places_.begin() + static_cast<long>(place));
  nearest_.erase(nearest_.begin() + static_cast<long>(place));
  for (size_t i = 0; i < places_.size(); ++i)
    if (nearest_[i].dissimilarity < 1 && nearest_[i].sequence == sequence) nearest_[i] = nearestTo(i);
}

}  // namespace comap
