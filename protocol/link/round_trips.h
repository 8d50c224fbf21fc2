// How long small messages to each peer take to be confirmed, and how often large ones should be repaired by that.
// Inside the link only.
#pragma once

#include <chrono>
#include <condition_variable>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "protocol/link/repair_pace.h"

namespace comap {

/// Has a thread of its own that looks every few milliseconds, as DDS does not tell when a message is confirmed.
/// Thread rule: any thread. Writers must outlive it, or be forgotten.
class RoundTrips {
 public:
  RoundTrips();
  ~RoundTrips();
  RoundTrips(const RoundTrips&) = delete;
  RoundTrips& operator=(const RoundTrips&) = delete;

  /// A small message was written to `peer`, whose small messages are all written by `writer`.
  void sent(const std::string& peer, const eprosima::fastdds::dds::DataWriter* writer);
  /// The peer's writers are about to go.
  void forget(const std::string& peer);
  /// Which of RepairPace::kPeriods fits this peer now.
  size_t choice(const std::string& peer) const;

 private:
  using Clock = std::chrono::steady_clock;
  struct Peer {
    const eprosima::fastdds::dds::DataWriter* writer = nullptr;
    std::optional<Clock::time_point> waiting_since;
    RepairPace pace;
  };
  void work();
  static void look(Peer& peer, Clock::time_point now);

  mutable std::mutex mutex_;
  std::condition_variable end_;
  bool ending_ = false;
  std::map<std::string, Peer> peers_;
  std::jthread thread_;
};

}  // namespace comap
