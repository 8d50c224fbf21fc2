#include "protocol/link/outlets.h"

#include <algorithm>
#include <limits>

#include "protocol/link/octets_type.h"
#include "protocol/link/qos.h"
#include "protocol/link/repair_pace.h"
#include "protocol/link/topics.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

constexpr size_t kMaxRobots = 256;

bool measuresPace(Topic topic) { return topic == Topic::kStatus || topic == Topic::kAck; }

int readersOf(const dds::DataWriter& writer) {
  dds::PublicationMatchedStatus status;
  const_cast<dds::DataWriter&>(writer).get_publication_matched_status(status);
  return status.current_count;
}

}  // namespace

Outlets::Outlets(const DdsLinkOptions& options, const Topics& topics) : options_(options), topics_(topics) {
  if (profileOf(options_) != "local") round_trips_ = std::make_unique<RoundTrips>();
}

Result<dds::Publisher*> Outlets::publisherTo(const std::string& partition) {
  if (const auto it = publishers_.find(partition); it != publishers_.end()) return it->second;
  if (publishers_.size() >= kMaxRobots) dropAbsent();
  if (publishers_.size() >= kMaxRobots)
    return Error{ErrorCode::kProblem, "more than " + std::to_string(kMaxRobots) + " robots on one link"};
  dds::PublisherQos qos = dds::PUBLISHER_QOS_DEFAULT;
  qos.partition().push_back(partition.c_str());
  dds::Publisher* publisher = participant_->create_publisher(qos);
  if (publisher == nullptr) return unreachable(options_, "creating the publisher of partition " + partition);
  return publishers_[partition] = publisher;
}

// Only when names run out: who is away for a moment finds what waits for it.
void Outlets::dropAbsent() {
  for (auto it = publishers_.begin(); it != publishers_.end();) {
    const bool there = std::any_of(writers_.begin(), writers_.end(), [&](const auto& entry) {
      return entry.first.second == it->first && std::any_of(entry.second.begin(), entry.second.end(),
                                                            [&](auto* writer) { return readersOf(*writer) > 0; });
    });
    const bool dropped = !there && dropWriters(it->first, *it->second) &&
                         participant_->delete_publisher(it->second) == ReturnCode_t::RETCODE_OK;
    it = dropped ? publishers_.erase(it) : std::next(it);
  }
}

bool Outlets::dropWriters(const std::string& partition, dds::Publisher& publisher) {
  if (round_trips_) round_trips_->forget(partition);
  for (auto it = writers_.begin(); it != writers_.end();) {
    if (it->first.second != partition) {
      ++it;
      continue;
    }
    auto& writers = it->second;
    while (!writers.empty()) {
      if (publisher.delete_datawriter(writers.back()) != ReturnCode_t::RETCODE_OK) return false;
      writers.pop_back();
    }
    it = writers_.erase(it);
  }
  return true;
}

// Of topics that are paced there is a writer for each period, opened together so that each has found its reader when
// its time comes.
Result<dds::DataWriter*> Outlets::writerOf(Topic topic, const std::string& robot) {
  const std::string partition = partitionWritten(options_.site, robot);
  const bool paced = round_trips_ && isPaced(topic);
  auto& writers = writers_[{topic, partition}];
  for (size_t i = writers.size(); i < (paced ? RepairPace::kPeriods.size() : 1); ++i) {
    const auto publisher = publisherTo(partition);
    if (!publisher) return publisher.error();
    dds::DataWriterQos qos = writerQos(topic, options_.max_blocking_ms);
    if (const auto told = announced_.find(topic); told != announced_.end())
      qos.user_data().data_vec({told->second.begin(), told->second.end()});
    if (paced) {
      const auto period_ms = RepairPace::kPeriods[i].count();
      qos.reliable_writer_qos().times.heartbeatPeriod = {static_cast<int32_t>(period_ms / 1000),
                                                         static_cast<uint32_t>(period_ms % 1000 * 1'000'000)};
      // A full writer would add a heartbeat to each datagram, which is answered by a request for all that is missing.
      qos.reliable_writer_qos().disable_heartbeat_piggyback = true;
    }
    dds::DataWriter* writer = (*publisher)->create_datawriter(topics_.at(topic), qos);
    if (writer == nullptr) return unreachable(options_, "creating the writer of " + topicName(topic));
    writers.push_back(writer);
  }
  return writers[paced ? round_trips_->choice(partition) : 0];
}

void Outlets::announce(Topic topic, const std::string& text) {
  announced_[topic] = text;
  for (const auto& [key, writers] : writers_) {
    for (dds::DataWriter* writer : writers) {
      if (key.first != topic) continue;
      dds::DataWriterQos qos = writer->get_qos();
      qos.user_data().data_vec({text.begin(), text.end()});
      writer->set_qos(qos);  // may be changed at any time
    }
  }
}

Result<void> Outlets::open(Topic topic, const std::string& robot) {
  const auto writer = writerOf(topic, robot);
  return writer ? Result<void>() : writer.error();
}

Result<void> Outlets::write(Topic topic, const std::string& robot, std::span<const uint8_t> payload) {
  const auto writer = writerOf(topic, robot);
  if (!writer) return writer.error();
  if (topic == Topic::kTile && readersOf(**writer) == 0)
    return Error{ErrorCode::kUnreachable, topicName(topic) + ": robot '" + robot + "' is not there"};
  Octets octets{robot, {payload.begin(), payload.end()}};
  const ReturnCode_t code = (*writer)->write(&octets, dds::HANDLE_NIL);
  if (code == ReturnCode_t::RETCODE_OK) {
    if (round_trips_ && measuresPace(topic)) round_trips_->sent(partitionWritten(options_.site, robot), *writer);
    return {};
  }
  const std::string what = topicName(topic) + ": " + std::to_string(payload.size()) + " bytes ";
  if (code == ReturnCode_t::RETCODE_TIMEOUT) {
    return Error{ErrorCode::kUnreachable, what + "not taken within " +
                                              std::to_string(maxBlocking_ms(topic, options_.max_blocking_ms)) +
                                              " ms by " + std::to_string(readersOf(**writer)) + " readers"};
  }
  return Error{ErrorCode::kUnreachable, what + "refused by DDS with code " + std::to_string(code())};
}

bool Outlets::delivered(Topic topic, const std::string& robot) const {
  const auto it = writers_.find({topic, partitionWritten(options_.site, robot)});
  return it == writers_.end() || std::all_of(it->second.begin(), it->second.end(), [](dds::DataWriter* writer) {
           return writer->wait_for_acknowledgments({0, 0}) == ReturnCode_t::RETCODE_OK;
         });
}

int Outlets::fewestReaders() const {
  int count = std::numeric_limits<int>::max();
  for (const auto& [topic, writers] : writers_)
    for (const dds::DataWriter* writer : writers) count = std::min(count, readersOf(*writer));
  return count;
}

}  // namespace comap
