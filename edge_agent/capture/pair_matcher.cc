#include "edge_agent/capture/pair_matcher.h"

#include <cstdlib>

namespace comap {
namespace {

constexpr size_t kKept = 16;

}  // namespace

void PairMatcher::addColour(Picture picture) {
  if (any_used_ && picture.stamp_ns <= used_colour_ns_) {
    ++unpaired_;
    return;
  }
  colour_.push_back(std::move(picture));
  if (colour_.size() > kKept) passOver();
  passOverAlone();
}

void PairMatcher::addDepth(Picture picture) {
  const int64_t stamp_ns = picture.stamp_ns;
  depth_period_.add(stamp_ns);
  if (any_used_ && stamp_ns <= used_depth_ns_) return;
  depth_.push_back(std::move(picture));
  if (depth_.size() > kKept) depth_.pop_front();
  passOverAlone();
}

// Pictures that no depth picture still to come can be near to.
void PairMatcher::passOverAlone() {
  while (!colour_.empty() && !depth_.empty() && depth_.back().stamp_ns > colour_.front().stamp_ns + max_gap_ns_ &&
         !partner(colour_.front().stamp_ns))
    passOver();
}

std::optional<size_t> PairMatcher::partner(int64_t stamp_ns) const {
  std::optional<size_t> best;
  int64_t best_gap_ns = max_gap_ns_;
  for (size_t i = 0; i < depth_.size(); ++i) {
    const int64_t gap_ns = std::abs(depth_[i].stamp_ns - stamp_ns);
    if (gap_ns > best_gap_ns || (best && gap_ns == best_gap_ns)) continue;
    best = i;
    best_gap_ns = gap_ns;
  }
  return best;
}

std::optional<PairMatcher::Found> PairMatcher::newest() const {
  for (size_t i = colour_.size(); i-- > 0;) {
    const int64_t stamp_ns = colour_[i].stamp_ns;
    const auto found = partner(stamp_ns);
    if (!found) continue;
    const int64_t behind_ns = stamp_ns - depth_[*found].stamp_ns;
    const int64_t period_ns = depth_period_.period_ns();
    const bool next_is_farther = period_ns > 0 && 2 * behind_ns <= period_ns;
    if (depth_.back().stamp_ns >= stamp_ns || next_is_farther) return Found{i, *found};
  }
  return std::nullopt;
}

void PairMatcher::passOver() {
  if (partner(colour_.front().stamp_ns)) {
    ++overtaken_;
  } else {
    ++unpaired_;
  }
  colour_.pop_front();
}

std::optional<PicturePair> PairMatcher::takeNewest() {
  const auto found = newest();
  if (!found) return std::nullopt;
  for (size_t i = 0; i < found->colour; ++i) passOver();
  PicturePair pair{std::move(colour_.front()), std::move(depth_[found->depth])};
  colour_.pop_front();
  depth_.erase(depth_.begin(), depth_.begin() + static_cast<std::ptrdiff_t>(found->depth) + 1);
  any_used_ = true;
  used_colour_ns_ = pair.colour.stamp_ns;
  used_depth_ns_ = pair.depth.stamp_ns;
  return pair;
}

}  // namespace comap
