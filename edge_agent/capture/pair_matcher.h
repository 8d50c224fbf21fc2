// Which depth picture belongs to which colour picture.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "edge_agent/capture/picture.h"
#include "edge_agent/capture/stream_period.h"

namespace comap {

struct PicturePair {
  Picture colour, depth;
};

/// Takes pictures of both streams as they come (stamps on one clock, growing within each stream) and gives pairs in
/// order of time, always the newest that is certain. Each picture is used once. Keeps the last 16 of each.
/// Thread rule: one thread.
class PairMatcher {
 public:
  /// Pictures farther apart than this are not a pair.
  explicit PairMatcher(int64_t max_gap_ns) : max_gap_ns_(max_gap_ns) {}

  void addColour(Picture picture);
  void addDepth(Picture picture);

  /// Whether takeNewest would give one. A pair is certain if no depth picture that is still to come can be nearer: one
  /// after the colour picture is there, or the next one is due farther off.
  bool hasPair() const { return newest().has_value(); }
  std::optional<PicturePair> takeNewest();

  uint64_t overtaken() const { return overtaken_; }  ///< colour pictures that had a partner and were passed over
  uint64_t unpaired() const { return unpaired_; }    ///< colour pictures that never had one

 private:
  struct Found {
    size_t colour, depth;
  };
  std::optional<size_t> partner(int64_t stamp_ns) const;
  std::optional<Found> newest() const;
  void passOver();
  void passOverAlone();

  int64_t max_gap_ns_;
  std::deque<Picture> colour_, depth_;
  StreamPeriod depth_period_;
  int64_t used_colour_ns_ = 0, used_depth_ns_ = 0;
  bool any_used_ = false;
  uint64_t overtaken_ = 0, unpaired_ = 0;
};

}  // namespace comap
