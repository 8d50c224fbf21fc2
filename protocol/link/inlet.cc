#include "protocol/link/inlet.h"

#include <utility>

namespace comap {

namespace dds = eprosima::fastdds::dds;
using eprosima::fastrtps::types::ReturnCode_t;

void Inlet::fill() {
  while (!head_ && maybe_more_) {
    maybe_more_ = false;
    // Robot by robot in turn, so that one that floods does not keep the others waiting.
    if (!takeAfter(last_robot_) && !takeAfter(dds::HANDLE_NIL)) return;
    maybe_more_ = true;
  }
}

Delivery Inlet::takeHead() {
  Delivery delivery = std::move(*head_);
  head_.reset();
  return delivery;
}

bool Inlet::takeAfter(const dds::InstanceHandle_t& previous) {
  dds::LoanableSequence<Octets> samples;
  dds::SampleInfoSeq infos;
  if (reader_->take_next_instance(samples, infos, 1, previous) != ReturnCode_t::RETCODE_OK) return false;
  if (infos.length() == 1) {
    last_robot_ = infos[0].instance_handle;
    if (infos[0].valid_data && !samples[0].damaged && isForUs(samples[0].robot) && genuine_(samples[0], infos[0])) {
      head_ = Delivery{topic_, std::move(samples[0].robot), std::move(samples[0].payload)};
      head_time_ = infos[0].reception_timestamp;
    }
  }
  reader_->return_loan(samples, infos);
  return true;
}

}  // namespace comap
