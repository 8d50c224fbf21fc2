#include "protocol/link/paced_writers.h"

#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>

namespace comap {
namespace {

using eprosima::fastrtps::types::ReturnCode_t;

constexpr std::chrono::milliseconds kLookEvery{20};

bool reachesAnyone(const eprosima::fastdds::dds::DataWriter* writer) {
  eprosima::fastdds::dds::PublicationMatchedStatus status;
  writer->get_publication_matched_status(status);
  return status.current_count > 0;
}

}  // namespace

PacedWriters::PacedWriters() : thread_([this] { work(); }) {}

PacedWriters::~PacedWriters() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  end_.notify_one();
  thread_.join();
}

void PacedWriters::measureBy(const std::string& peer, eprosima::fastdds::dds::DataWriter* small) {
  const std::lock_guard lock(mutex_);
  peers_[peer].small = small;
}

void PacedWriters::pace(const std::string& peer, eprosima::fastdds::dds::DataWriter* large) {
  const std::lock_guard lock(mutex_);
  peers_[peer].large.push_back(large);
  peers_[peer].set = {};
}

void PacedWriters::sent(const std::string& peer) {
  const std::lock_guard lock(mutex_);
  auto& since = peers_[peer].waiting_since;
  if (!since) since = Clock::now();
}

void PacedWriters::look(Peer& peer, Clock::time_point now) {
  if (peer.waiting_since) {
    const auto since = std::chrono::duration_cast<RepairPace::Duration>(now - *peer.waiting_since);
    if (!reachesAnyone(peer.small)) {
      peer.waiting_since.reset();
    } else if (peer.small->wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK) {
      peer.pace.confirmed(since);
      peer.waiting_since.reset();
    } else {
      peer.pace.waiting(since);
    }
  }
  const RepairPace::Duration period = peer.pace.period();
  if (period == peer.set) return;
  for (auto* writer : peer.large) {
    eprosima::fastdds::dds::DataWriterQos qos = writer->get_qos();
    qos.reliable_writer_qos().times.heartbeatPeriod =
        eprosima::fastrtps::Duration_t(1e-3 * static_cast<double>(period.count()));
    (void)writer->set_qos(qos);
  }
  peer.set = period;
}

void PacedWriters::work() {
  std::unique_lock lock(mutex_);
  while (!end_.wait_for(lock, kLookEvery, [this] { return ending_; })) {
    const auto now = Clock::now();
    for (auto& [name, peer] : peers_)
      if (peer.small != nullptr) look(peer, now);
  }
}

}  // namespace comap
