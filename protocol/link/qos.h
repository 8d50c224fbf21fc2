// Delivery per topic (docs/wire.md, "Delivery") and the transports. Inside the link only.
#pragma once

#include <fastdds/dds/domain/qos/DomainParticipantQos.hpp>
#include <fastdds/dds/publisher/qos/DataWriterQos.hpp>
#include <fastdds/dds/subscriber/qos/DataReaderQos.hpp>
#include <string>

#include "protocol/link/dds_link.h"
#include "protocol/link/link.h"

namespace comap {

/// After this long without a word a participant counts as gone.
inline constexpr int kLease_s = 10;

/// UDP on the one interface. Profiles lan and wan: in datagrams that need no IP fragments. wan, or with a discovery
/// server: no multicast; whoever has a core_address looks there, and at `introducer_port` of the interface if it is not
/// 0.
eprosima::fastdds::dds::DomainParticipantQos participantQos(const std::string& name, const DdsLinkOptions& options,
                                                            uint16_t introducer_port = 0);
/// How long a write to `topic` waits for room: only keyframes are waited with, all else comes again by itself.
int maxBlocking_ms(Topic topic, int max_blocking_ms);
/// `max_blocking_ms`: how long a reader that takes nothing can hold the writer.
eprosima::fastdds::dds::DataWriterQos writerQos(Topic topic, int max_blocking_ms);
eprosima::fastdds::dds::DataReaderQos readerQos(Topic topic);

}  // namespace comap
