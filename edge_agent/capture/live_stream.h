// Keeps one stream of a camera running: reads it on a thread of its own and opens it again when it is gone.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "edge_agent/capture/picture_inbox.h"
#include "edge_agent/capture/picture_stream.h"

namespace comap {

struct LiveStreamOptions {
  std::chrono::milliseconds stalled_after{1000};  ///< without a picture
  std::chrono::milliseconds retry_every{500};     ///< to open a device that is gone
};

/// Reads from construction to destruction. Pictures go into the inbox with stamps that can be believed (StampGuard);
/// its health there is always up to date.
class LiveStream {
 public:
  /// `stream` is open already; `open` opens it again. `inbox` must outlive this.
  LiveStream(PictureKind kind, std::unique_ptr<PictureStream> stream, StreamOpener open, PictureInbox& inbox,
             LiveStreamOptions options = {});
  ~LiveStream();
  LiveStream(const LiveStream&) = delete;
  LiveStream& operator=(const LiveStream&) = delete;

 private:
  void run(const std::stop_token& stop);
  void read(const std::stop_token& stop);
  void reopen(const std::stop_token& stop);

  PictureKind kind_;
  std::unique_ptr<PictureStream> stream_;  // the thread's
  StreamOpener open_;
  PictureInbox& inbox_;
  LiveStreamOptions options_;
  std::mutex sleep_mutex_;
  std::condition_variable_any sleep_;
  std::jthread thread_;  // last: it uses all of the above
};

}  // namespace comap
