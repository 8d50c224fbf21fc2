// A DDS content filter that passes the samples keyed with one robot's name, or to all. Run by the writer where it can,
// so that what is for others does not travel at all. Inside the link only.
#pragma once

#include <fastdds/dds/topic/IContentFilterFactory.hpp>

namespace comap {

inline constexpr const char* kOwnSamplesFilter = "COMAP_OWN";

/// Makes filters from the expression "robot" with the one parameter: the robot's name.
class OwnSamplesFilterFactory : public eprosima::fastdds::dds::IContentFilterFactory {
 public:
  ReturnCode_t create_content_filter(const char* filter_class_name, const char* type_name,
                                     const eprosima::fastdds::dds::TopicDataType* type, const char* expression,
                                     const ParameterSeq& parameters,
                                     eprosima::fastdds::dds::IContentFilter*& filter) override;
  ReturnCode_t delete_content_filter(const char* filter_class_name,
                                     eprosima::fastdds::dds::IContentFilter* filter) override;
};

}  // namespace comap
