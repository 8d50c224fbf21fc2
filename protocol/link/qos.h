// Delivery per topic (docs/wire.md, "Delivery") and the transports. Inside the link only.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <string>

#include "protocol/link/link.h"

namespace comap {

/// How long publish waits for room, and with it how long a reader that takes nothing can hold a writer.
inline constexpr int kMaxBlocking_s = 10;
/// After this long without a word a participant counts as gone.
inline constexpr int kLease_s = 10;

/// Loopback: UDP on 127.0.0.1, nothing leaves the machine. Any other address: UDP on that interface
/// alone, in datagrams that need no IP fragments.
eprosima::fastdds::dds::DomainParticipantQos participantQos(const std::string& name,
                                                            const std::string& interface_address);
eprosima::fastdds::dds::DataWriterQos writerQos(Topic topic);
eprosima::fastdds::dds::DataReaderQos readerQos(Topic topic);

}  // namespace comap
