// Keyframes on their way to the core: kept until acknowledged, a few in flight at a time, sent again when overdue;
// those of earlier lives of the agent too.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "edge_agent/uplink/loss_log.h"
#include "edge_agent/uplink/outbox.h"
#include "edge_agent/uplink/refused_keyframes.h"
#include "edge_agent/uplink/send_window.h"
#include "protocol/link/link.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/messages.h"

namespace comap {

struct SenderOptions {
  SendOptions send;
  int jpeg_quality = 90;
  int thin_jpeg_quality = 30;  ///< of colour once the outbox is full
  uint64_t outbox_quota_bytes = 2'000'000'000;
};

/// This session's keyframes go first, then those of the session before it, and so on: what the robot sees now places
/// it and brings its map back. Within a session the oldest goes first, as the core maps it in order.
/// Thread rule: one thread.
class KeyframeSender {
 public:
  using Log = std::function<void(const std::string& line)>;
  /// `outbox` may hold keyframes of earlier sessions, all below `session`.
  KeyframeSender(Link& link, const std::string& robot, uint64_t session, const SenderOptions& options, Outbox outbox,
                 Log log);

  /// Encodes a keyframe and keeps it until it is acknowledged. If the outbox cannot be written it is kept in memory
  /// for now, which is told. kWrongUse if its sequence is not above all before.
  Result<void> add(const Keyframe& keyframe);
  /// Sends what is due at `now`. A link that takes nothing is no error: it stays due.
  void sendDue(std::chrono::steady_clock::time_point now);
  /// A keyframe that the core cannot take stays, lets the others pass, and is sent again seldom (RefusedKeyframes).
  void acknowledge(const Acknowledgement& acknowledgement, std::chrono::steady_clock::time_point now);
  /// Tells the log what was given up and not yet told (LossLog). Call it now and then.
  void tellLosses(std::chrono::steady_clock::time_point now) { loss_log_.note(losses_, waitingBytes(), now); }
  /// After the disk took nothing: whether it does again, every few seconds. What was acknowledged is then taken out of
  /// the outbox, and what is in memory goes into it, the oldest first and one at each call. Call it now and then.
  void tryDisk(std::chrono::steady_clock::time_point now);
  /// All of that at once: nothing comes after this. What the disk does not take stays in memory.
  void saveToDisk();

  size_t waiting() const { return sizeOf(session_); }  ///< of this session
  size_t waitingInAll() const;
  size_t waitingInMemory() const { return spare_ ? spare_->size() : 0; }  ///< because the outbox's disk failed
  /// The core holds them, but the outbox's disk does not even take that: another start sends them once more.
  size_t deliveredButThere() const { return outbox_.deliveredButThere().size(); }
  uint64_t waitingBytes() const;
  uint64_t bytesSent() const { return bytes_sent_; }  ///< repeats included
  /// What the link delivers, as far as keyframes have shown it. 0: not known.
  double uplinkBytesPerSecond() const { return window_.rate().bytesPerSecond(); }
  const SenderLosses& losses() const { return losses_; }
  /// Keyframes that an outbox had lost before it was given to this.
  void countDamaged(uint32_t keyframes) { losses_.damaged += keyframes; }
  const RefusedKeyframes& refused() const { return refused_; }
  /// What a status tells of them: a few, others each time.
  std::vector<RefusedKeyframe> refusedToTell();

 private:
  size_t sizeOf(uint64_t session) const;
  uint32_t missingBefore(uint32_t sequence);
  Result<void> store(const OutboxRow& row, std::span<const uint8_t> encoded);
  Result<void> moveOldestToDisk();
  void takeOutDelivered();
  void diskTakes();
  void keepWithinQuota();
  std::optional<OutboxKey> nextUnsent();
  bool send(const OutboxKey& key, std::chrono::steady_clock::time_point now);
  Outbox& boxOf(const OutboxKey& key);
  void failed(const Error& error);
  void refuse(uint32_t checksum, const std::string& reason, std::chrono::steady_clock::time_point now);

  Link& link_;
  const std::string robot_;
  const uint64_t session_;
  const SenderOptions options_;
  Log log_;
  Outbox outbox_;
  std::optional<Outbox> spare_;  // in memory: where keyframes go while the outbox cannot be written
  SendWindow window_;
  RefusedKeyframes refused_;
  std::map<uint64_t, uint32_t> next_;              // of each session, the sequence from which nothing was sent yet
  std::map<uint32_t, KeyframeLink> dropped_;       // of this session; links to them are joined to theirs
  bool broken_ = false;                            // keyframes before the next one were lost, as dropped_ says
  uint32_t acknowledged_below_ = 0;                // of this session
  OutboxKey cursor_;                               // of makeRoom
  std::chrono::steady_clock::time_point retry_{};  // not before this, after the link took nothing
  std::chrono::steady_clock::time_point disk_{};   // nor before this, after the disk took nothing
  bool had_peer_ = true;
  bool failing_ = false;
  uint64_t bytes_sent_ = 0;
  SenderLosses losses_;
  LossLog loss_log_;
};

}  // namespace comap
