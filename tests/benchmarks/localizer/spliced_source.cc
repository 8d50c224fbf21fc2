#include "tests/benchmarks/localizer/spliced_source.h"

namespace comap {

constexpr int64_t kFrame_ns = 33'333'333;

SplicedSource::SplicedSource(std::unique_ptr<FrameSource> first, int covered, std::unique_ptr<FrameSource> second)
    : first_(std::move(first)), second_(std::move(second)), covered_(covered), left_(covered) {}

Result<std::optional<Frame>> SplicedSource::next() {
  std::optional<Frame> frame;
  if (first_) {
    auto taken = first_->next();
    if (!taken) return taken;
    frame = std::move(*taken);
    if (!frame) first_.reset();
  }
  original_ns_ = -1;
  if (frame) {
    last_ = *frame;
    original_ns_ = frame->stamp_ns;
  } else if (left_ > 0) {
    --left_;
    frame = last_;
    frame->colour = ColourImage(last_.colour.width(), last_.colour.height());
    frame->depth = DepthImage(last_.depth.width(), last_.depth.height());
  } else if (second_) {
    auto taken = second_->next();
    if (!taken) return taken;
    frame = std::move(*taken);
    if (frame) original_ns_ = frame->stamp_ns;
    in_second_ = true;
  }
  if (!frame) return std::optional<Frame>();
  frame->stamp_ns = ++given_ * kFrame_ns;
  return frame;
}

size_t SplicedSource::size() const {
  return (first_ ? first_->size() : 0) + static_cast<size_t>(covered_) + (second_ ? second_->size() : 0);
}

}  // namespace comap
