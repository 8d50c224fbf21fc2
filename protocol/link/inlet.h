// What a link reads of one topic. Inside the link only.
#pragma once

#include <atomic>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <functional>
#include <optional>
#include <string>

#include "protocol/link/bell.h"
#include "protocol/link/link.h"
#include "protocol/link/octets_type.h"

namespace comap {

/// One reader and the next sample of it, taken out of DDS ahead of delivery to compare ages across topics.
/// Thread rule: one thread, but for the listener's call.
class Inlet : public eprosima::fastdds::dds::DataReaderListener {
 public:
  using Genuine = std::function<bool(const Octets&, const eprosima::fastdds::dds::SampleInfo&)>;

  /// `only_for`: the robot whose samples are taken; empty: everyone's. Others than `genuine` ones are passed over.
  Inlet(Topic topic, std::string only_for, Bell& bell, Genuine genuine)
      : topic_(topic), only_for_(std::move(only_for)), bell_(bell), genuine_(std::move(genuine)) {}

  void on_data_available(eprosima::fastdds::dds::DataReader*) override {
    maybe_more_ = true;
    bell_.ring();
  }

  void setReader(eprosima::fastdds::dds::DataReader* reader) { reader_ = reader; }
  eprosima::fastdds::dds::DataReader* reader() const { return reader_; }

  /// Fills the head if it is empty and DDS holds a sample.
  void fill();
  bool hasHead() const { return head_.has_value(); }
  const eprosima::fastrtps::rtps::Time_t& headTime() const { return head_time_; }
  Delivery takeHead();

 private:
  bool takeAfter(const eprosima::fastdds::dds::InstanceHandle_t& previous);
  bool isForUs(const std::string& robot) const { return only_for_.empty() || robot == only_for_; }

  const Topic topic_;
  const std::string only_for_;
  Bell& bell_;
  const Genuine genuine_;
  eprosima::fastdds::dds::DataReader* reader_ = nullptr;
  std::atomic<bool> maybe_more_ = true;
  eprosima::fastdds::dds::InstanceHandle_t last_robot_ = eprosima::fastdds::dds::HANDLE_NIL;
  std::optional<Delivery> head_;
  eprosima::fastrtps::rtps::Time_t head_time_;
};

}  // namespace comap
