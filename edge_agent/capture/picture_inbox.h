// Where the threads that read a camera put what they got, and the agent's thread takes it.
#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <vector>

#include "edge_agent/capture/capture_health.h"
#include "edge_agent/capture/picture.h"

namespace comap {

/// The one place that camera threads share with the agent's. Holds the newest 8 pictures of each stream; older ones go
/// and are counted. Any thread.
class PictureInbox {
 public:
  /// With `health`, in which it counts: whoever takes the picture finds its stream streaming.
  void put(PictureKind kind, Picture picture, const StreamHealth& health);
  void tell(PictureKind kind, const StreamHealth& health);

  /// All pictures of a stream that came since, oldest first.
  std::vector<Picture> take(PictureKind kind);
  StreamHealth health(PictureKind kind) const;
  /// Pictures of a stream that were pushed out by newer ones before anybody took them.
  uint64_t pushedOut(PictureKind kind) const;

  /// Waits until something was put or told since the last call, or `until`; false if nothing was.
  bool waitForNews(std::chrono::steady_clock::time_point until);

 private:
  struct Slot {
    std::deque<Picture> pictures;
    StreamHealth health;
    uint64_t pushed_out = 0;
  };
  Slot& slot(PictureKind kind) { return slots_[static_cast<size_t>(kind)]; }
  const Slot& slot(PictureKind kind) const { return slots_[static_cast<size_t>(kind)]; }

  mutable std::mutex mutex_;
  std::condition_variable bell_;
  bool news_ = false;
  std::array<Slot, 2> slots_;
};

}  // namespace comap
