// The one DDS type of all topics: struct comap::v1::Octets { @key string robot; sequence<octet> payload; }.
// Plain CDR (XCDR1), so that any DDS vendor can read it. Inside the link only.
#pragma once

#include <fastdds/dds/topic/TopicDataType.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace comap {

struct Octets {
  std::string robot;
  std::vector<uint8_t> payload;
  bool damaged = false;  ///< came over the wire as bytes that are no Octets; not part of the type
};

class OctetsType : public eprosima::fastdds::dds::TopicDataType {
 public:
  OctetsType();
  bool serialize(void* data, eprosima::fastrtps::rtps::SerializedPayload_t* to) override;
  /// Always true: Fast DDS has no good answer to a sample that cannot be read. See Octets::damaged.
  bool deserialize(eprosima::fastrtps::rtps::SerializedPayload_t* from, void* data) override;
  std::function<uint32_t()> getSerializedSizeProvider(void* data) override;
  void* createData() override;
  void deleteData(void* data) override;
  bool getKey(void* data, eprosima::fastrtps::rtps::InstanceHandle_t* handle, bool force_md5) override;
};

}  // namespace comap
