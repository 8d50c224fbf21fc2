#include "edge_agent/uplink/keyframe_sender.h"

#include "protocol/codec/keyframe_codec.h"

namespace comap {

Result<void> KeyframeSender::add(const Keyframe& keyframe) {
  auto encoded = encodeKeyframe(keyframe, options_.jpeg_quality);
  if (!encoded) return encoded.error();
  return outbox_.add(keyframe.id.sequence, std::move(*encoded));
}

void KeyframeSender::sendDue(std::chrono::steady_clock::time_point now) {
  for (const uint32_t sequence : outbox_.due(now, options_.window, options_.resend_after)) {
    const auto bytes = outbox_.encoded(sequence);
    if (link_.publish(Topic::kKeyframe, robot_, bytes))
      bytes_sent_ += bytes.size();
    else
      outbox_.notSent(sequence);
  }
}

}  // namespace comap
