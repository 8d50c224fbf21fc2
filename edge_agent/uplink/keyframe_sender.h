// Keyframes on their way to the core: kept until acknowledged, a few in flight at a time, sent again when overdue.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "protocol/link/link.h"
#include "protocol/session/outbox.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/messages.h"

namespace comap {

struct SenderOptions {
  size_t window = 8;  ///< keyframes in flight
  std::chrono::milliseconds resend_after{3000};
  int jpeg_quality = 90;
};

/// Thread rule: one thread.
class KeyframeSender {
 public:
  KeyframeSender(Link& link, const std::string& robot, uint64_t session, const SenderOptions& options)
      : link_(link), robot_(robot), options_(options), outbox_(robot, session) {}

  /// Encodes a keyframe and keeps it until it is acknowledged.
  Result<void> add(const Keyframe& keyframe);
  /// Sends what is due at `now`. A link that takes nothing is no error: it stays due.
  void sendDue(std::chrono::steady_clock::time_point now);
  void acknowledge(const Acknowledgement& acknowledgement) { outbox_.acknowledge(acknowledgement); }

  size_t waiting() const { return outbox_.size(); }
  uint64_t bytesSent() const { return bytes_sent_; }  ///< repeats included

 private:
  Link& link_;
  std::string robot_;
  SenderOptions options_;
  Outbox outbox_;
  uint64_t bytes_sent_ = 0;
};

}  // namespace comap
