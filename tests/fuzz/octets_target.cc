// A DDS sample.
#include <algorithm>

#include "protocol/link/octets_type.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;
using eprosima::fastrtps::rtps::SerializedPayload_t;

COMAP_FUZZ_TARGET(bytes) {
  OctetsType type;
  SerializedPayload_t payload(static_cast<uint32_t>(std::max<size_t>(bytes.size(), 1)));
  std::copy(bytes.begin(), bytes.end(), payload.data);
  payload.length = static_cast<uint32_t>(bytes.size());
  Octets octets;
  type.deserialize(&payload, &octets);
  if (octets.damaged) return;
  SerializedPayload_t again(type.getSerializedSizeProvider(&octets)());
  fuzz::require(type.serialize(&octets, &again), "what was read can be written");
  Octets reread;
  type.deserialize(&again, &reread);
  fuzz::require(!reread.damaged && reread.robot == octets.robot && reread.payload == octets.payload,
                "a sample stays what it is");
}
