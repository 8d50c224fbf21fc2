#include "edge_agent/capture/live_stream.h"

#include "edge_agent/capture/device_clock.h"
#include "edge_agent/capture/stamp_guard.h"

namespace comap {
namespace {

constexpr std::chrono::milliseconds kTurn{50};  // how long a stop may have to wait
using Clock = std::chrono::steady_clock;

}  // namespace

LiveStream::LiveStream(PictureKind kind, std::unique_ptr<PictureStream> stream, StreamOpener open, PictureInbox& inbox,
                       LiveStreamOptions options)
    : kind_(kind),
      stream_(std::move(stream)),
      open_(std::move(open)),
      inbox_(inbox),
      options_(options),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

LiveStream::~LiveStream() {
  thread_.request_stop();
  thread_.join();
}

void LiveStream::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    read(stop);
    if (!stop.stop_requested()) reopen(stop);
  }
}

// Until the stream is gone.
void LiveStream::read(const std::stop_token& stop) {
  StampGuard guard;
  StreamHealth health = inbox_.health(kind_);
  const StreamHealth before = health;
  auto last = Clock::now();
  while (!stop.stop_requested()) {
    auto taken = stream_->take(kTurn);
    if (!taken && taken.error().code == ErrorCode::kUnreachable) {
      health.state = StreamState::kGone;
      health.problem = taken.error().text;
      inbox_.tell(kind_, health);
      return;
    }
    if (!taken) {
      ++health.damaged;
      health.problem = taken.error().text;
      last = Clock::now();
    } else if (*taken) {
      Picture picture = std::move(**taken);
      const auto stamp_ns = guard.accept(picture.stamp_ns, picture.sequence, monotonicNow_ns());
      health.missed = before.missed + guard.missed();
      health.repeated = before.repeated + guard.repeated();
      health.clock_jumps = before.clock_jumps + guard.jumps();
      if (stamp_ns) {
        picture.stamp_ns = *stamp_ns;
        health.state = StreamState::kStreaming;
        ++health.taken;
        last = Clock::now();
        inbox_.put(kind_, std::move(picture), health);
      }
    }
    // A picture that comes again and again is no stream.
    if (Clock::now() - last > options_.stalled_after) {
      if (health.state != StreamState::kStalled) ++health.stalls;
      health.state = StreamState::kStalled;
    }
    inbox_.tell(kind_, health);
  }
}

void LiveStream::reopen(const std::stop_token& stop) {
  stream_.reset();  // a device that is held open does not come back under its name
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(sleep_mutex_);
      sleep_.wait_for(lock, stop, options_.retry_every, [] { return false; });
    }
    if (stop.stop_requested()) return;
    auto opened = open_();
    StreamHealth health = inbox_.health(kind_);
    if (opened) {
      stream_ = std::move(*opened);
      health.state = StreamState::kStarting;
      health.problem.clear();
      ++health.reopened;
      inbox_.tell(kind_, health);
      return;
    }
    health.problem = opened.error().text;
    inbox_.tell(kind_, health);
  }
}

}  // namespace comap
