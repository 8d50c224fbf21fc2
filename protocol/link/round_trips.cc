#include "protocol/link/round_trips.h"

namespace comap {
namespace {

using eprosima::fastdds::dds::DataWriter;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr std::chrono::milliseconds kLookEvery{20};

bool reachesAnyone(const DataWriter& writer) {
  eprosima::fastdds::dds::PublicationMatchedStatus status;
  writer.get_publication_matched_status(status);
  return status.current_count > 0;
}

bool isConfirmed(const DataWriter& writer) {
  return const_cast<DataWriter&>(writer).wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK;
}

}  // namespace

RoundTrips::RoundTrips() : thread_([this] { work(); }) {}

RoundTrips::~RoundTrips() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  end_.notify_one();
  thread_.join();
}

void RoundTrips::sent(const std::string& peer, const DataWriter* writer) {
  const std::lock_guard lock(mutex_);
  Peer& it = peers_[peer];
  it.writer = writer;
  if (!it.waiting_since) it.waiting_since = Clock::now();
}

void RoundTrips::forget(const std::string& peer) {
  const std::lock_guard lock(mutex_);
  peers_.erase(peer);
}

size_t RoundTrips::choice(const std::string& peer) const {
  const std::lock_guard lock(mutex_);
  const auto it = peers_.find(peer);
  return it == peers_.end() ? RepairPace().choice() : it->second.pace.choice();
}

void RoundTrips::look(Peer& peer, Clock::time_point now) {
  if (!peer.waiting_since) return;
  const auto since = std::chrono::duration_cast<RepairPace::Duration>(now - *peer.waiting_since);
  if (!reachesAnyone(*peer.writer)) {
    peer.waiting_since.reset();
  } else if (isConfirmed(*peer.writer)) {
    peer.pace.confirmed(since);
    peer.waiting_since.reset();
  } else {
    peer.pace.waiting(since);
  }
}

void RoundTrips::work() {
  std::unique_lock lock(mutex_);
  while (!end_.wait_for(lock, kLookEvery, [this] { return ending_; })) {
    const auto now = Clock::now();
    for (auto& [name, peer] : peers_) look(peer, now);
  }
}

}  // namespace comap
