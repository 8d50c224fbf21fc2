// Recordings one after the other, as one robot's camera would give them that is covered and carried off in between.
#pragma once

#include <deque>
#include <memory>
#include <string>
#include <vector>

#include "edge_agent/capture/frame_source.h"

namespace comap {

class SplicedSource final : public FrameSource {
 public:
  /// Plays `first`, then `covered` black frames without depth, then `second`; 30 frames a second, whatever the stamps.
  SplicedSource(std::unique_ptr<FrameSource> first, int covered, std::unique_ptr<FrameSource> second);

  Result<std::optional<Frame>> next() override;
  size_t size() const override;
  std::string description() const override { return "spliced"; }

  /// The stamp that the frame last given has in its own recording; -1 for a covered one.
  int64_t original_ns() const { return original_ns_; }
  /// Whether the frame last given is of the second recording.
  bool inSecond() const { return in_second_; }

 private:
  std::unique_ptr<FrameSource> first_, second_;
  int covered_, left_;
  int64_t given_ = 0, original_ns_ = -1;
  bool in_second_ = false;
  Frame last_;
};

}  // namespace comap
