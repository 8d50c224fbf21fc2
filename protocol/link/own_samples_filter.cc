#include "protocol/link/own_samples_filter.h"

#include <fastdds/dds/topic/IContentFilter.hpp>
#include <string>

#include "protocol/link/octets_type.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;

class OwnSamplesFilter final : public dds::IContentFilter {
 public:
  explicit OwnSamplesFilter(std::string robot) : robot_(std::move(robot)) {}
  bool evaluate(const SerializedPayload& payload, const FilterSampleInfo&, const GUID_t&) const override {
    const auto robot = robotOf(payload);
    return robot && (robot->empty() || *robot == robot_);
  }

 private:
  const std::string robot_;
};

}  // namespace

OwnSamplesFilterFactory::ReturnCode_t OwnSamplesFilterFactory::create_content_filter(const char*, const char*,
                                                                                     const dds::TopicDataType*,
                                                                                     const char*,
                                                                                     const ParameterSeq& parameters,
                                                                                     dds::IContentFilter*& filter) {
  if (parameters.length() != 1 || parameters[0] == nullptr) return ReturnCode_t::RETCODE_BAD_PARAMETER;
  std::string robot = parameters[0];
  delete static_cast<OwnSamplesFilter*>(filter);  // set if the parameters of a filter in use change
  filter = new OwnSamplesFilter(std::move(robot));
  return ReturnCode_t::RETCODE_OK;
}

OwnSamplesFilterFactory::ReturnCode_t OwnSamplesFilterFactory::delete_content_filter(const char*,
                                                                                     dds::IContentFilter* filter) {
  delete static_cast<OwnSamplesFilter*>(filter);
  return ReturnCode_t::RETCODE_OK;
}

}  // namespace comap
