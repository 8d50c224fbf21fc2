// What a link writes: publishers and writers by topic and partition, opened when they are first needed. Inside the link
// only.
#pragma once

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/topic/Topic.hpp>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "protocol/link/dds_options.h"
#include "protocol/link/link.h"
#include "protocol/link/round_trips.h"

namespace comap {

/// Thread rule: one thread at a time.
class Outlets {
 public:
  using Topics = std::map<Topic, eprosima::fastdds::dds::Topic*>;

  /// `options` and `topics` outlive it; of topics those that are written must be there when they first are.
  Outlets(const DdsLinkOptions& options, const Topics& topics);

  /// Before all else; DDS deletes what is made here with `participant`.
  void join(eprosima::fastdds::dds::DomainParticipant& participant) { participant_ = &participant; }
  /// Before DDS deletes the writers.
  void leave() { round_trips_.reset(); }

  Result<void> open(Topic topic, const std::string& robot);
  /// What writers of `topic` tell of themselves to who discovers them, from now on.
  void announce(Topic topic, const std::string& text);
  /// Errors as Link::publish.
  Result<void> write(Topic topic, const std::string& robot, std::span<const uint8_t> payload);
  /// As Link::delivered.
  bool delivered(Topic topic, const std::string& robot) const;
  /// Of all open writers the least number of readers; the largest number if there is no writer.
  int fewestReaders() const;

 private:
  using Writers = std::vector<eprosima::fastdds::dds::DataWriter*>;

  Result<eprosima::fastdds::dds::DataWriter*> writerOf(Topic topic, const std::string& robot);
  Result<eprosima::fastdds::dds::Publisher*> publisherTo(const std::string& partition);
  void dropAbsent();
  bool dropWriters(const std::string& partition, eprosima::fastdds::dds::Publisher& publisher);

  const DdsLinkOptions& options_;
  const Topics& topics_;
  eprosima::fastdds::dds::DomainParticipant* participant_ = nullptr;
  std::map<std::string, eprosima::fastdds::dds::Publisher*> publishers_;  // by partition
  std::map<std::pair<Topic, std::string>, Writers> writers_;              // by topic and partition
  std::map<Topic, std::string> announced_;
  std::unique_ptr<RoundTrips> round_trips_;  // where a link can be slow
};

}  // namespace comap
