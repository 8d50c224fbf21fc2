// Sets the repair period of writers of large messages from how long small ones of the same peer take. Inside the link
// only.
#pragma once

#include <condition_variable>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "protocol/link/repair_pace.h"

namespace comap {

/// Has a thread of its own that looks every few milliseconds, as DDS does not tell when a message is confirmed.
/// Thread rule: any thread. Writers must outlive it.
class PacedWriters {
 public:
  PacedWriters();
  ~PacedWriters();
  PacedWriters(const PacedWriters&) = delete;
  PacedWriters& operator=(const PacedWriters&) = delete;

  /// The messages of `small` to `peer` are measured by.
  void measureBy(const std::string& peer, eprosima::fastdds::dds::DataWriter* small);
  void pace(const std::string& peer, eprosima::fastdds::dds::DataWriter* large);
  /// A message was written to the peer's small writer.
  void sent(const std::string& peer);

 private:
  using Clock = std::chrono::steady_clock;
  struct Peer {
    eprosima::fastdds::dds::DataWriter* small = nullptr;
    std::vector<eprosima::fastdds::dds::DataWriter*> large;
    std::optional<Clock::time_point> waiting_since;
    RepairPace pace;
    RepairPace::Duration set{};  // of the writers, at present
  };
  void work();
  static void look(Peer& peer, Clock::time_point now);

  std::mutex mutex_;
  std::condition_variable end_;
  bool ending_ = false;
  std::map<std::string, Peer> peers_;
  std::thread thread_;
};

}  // namespace comap
