// Tells the log what is given up for want of room.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>

namespace comap {

/// Since the start of the agent.
struct SenderLosses {
  uint32_t thinned = 0;  ///< sent with poorer colour, for want of room
  uint32_t dropped = 0;  ///< never sent, for want of room or because a disk failed
  uint32_t damaged = 0;  ///< never sent, for they were in an outbox that was damaged
};

/// What is given up is told once: the first at once, that of the next half minute together, and so on. Time is passed
/// in. Thread rule: one thread.
class LossLog {
 public:
  using Clock = std::chrono::steady_clock;
  explicit LossLog(std::function<void(const std::string& line)> log) : log_(std::move(log)) {}
  ~LossLog() { tell(); }
  LossLog(const LossLog&) = delete;
  LossLog& operator=(const LossLog&) = delete;

  /// `waiting_bytes`: what the outbox holds now.
  void note(const SenderLosses& losses, uint64_t waiting_bytes, Clock::time_point now);
  /// All that is not told yet.
  void tell();

 private:
  const std::function<void(const std::string& line)> log_;
  SenderLosses losses_, told_;
  uint64_t waiting_bytes_ = 0;
  Clock::time_point next_{};
};

}  // namespace comap
