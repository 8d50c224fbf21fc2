// How many of a camera's frames the processor can do.
#pragma once

#include <algorithm>
#include <cstdint>

namespace comap {

/// The rule: one of `every` frames is taken, at even distances. When work on a frame takes more than 0.9 of the time
/// that it has (`every` periods of the camera), on average over about eight frames, `every` grows by one, up to 8; when
/// it would take less than 0.7 of the time with one less, for 30 frames in a row, `every` shrinks by one.
/// Thread rule: one thread.
class RateRule {
 public:
  /// After a frame that was worked on for `work_ns`, while the camera gives one each `period_ns`.
  void worked(int64_t work_ns, int64_t period_ns);

  /// Whether a frame of this stamp is to be taken, the last one taken having been of `last_ns`.
  bool due(int64_t stamp_ns, int64_t last_ns) const;

  /// Of so many frames at least one is taken, for other reasons than work: it changes nothing of the rule for work.
  void setLeast(int every) { least_ = every; }

  int every() const { return std::max(every_, least_); }

 private:
  int every_ = 1, least_ = 1, frames_ = 0, calm_ = 0;
  double work_ns_ = 0;
  int64_t period_ns_ = 0;
};

}  // namespace comap
