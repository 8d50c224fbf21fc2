#include "edge_agent/uplink/loss_log.h"

#include "protocol/types/counted.h"

namespace comap {
namespace {

constexpr std::chrono::seconds kPeriod{30};

// "12 keyframes more have coarser colour (40 in all)"
std::string part(uint32_t all, uint32_t told, const char* one, const char* many) {
  const std::string more = told > 0 ? " more" : "", sum = told > 0 ? " (" + std::to_string(all) + " in all)" : "";
  return counted(all - told, "keyframe") + more + wordFor(all - told, one, many) + sum;
}

}  // namespace

void LossLog::note(const SenderLosses& losses, uint64_t waiting_bytes, Clock::time_point now) {
  losses_ = losses;
  waiting_bytes_ = waiting_bytes;
  if (now < next_) return;
  const bool news = losses_.thinned != told_.thinned || losses_.dropped != told_.dropped;
  tell();
  if (news) next_ = now + kPeriod;
}

void LossLog::tell() {
  std::string text;
  if (losses_.thinned > told_.thinned)
    text = part(losses_.thinned, told_.thinned, " has coarser colour", " have coarser colour");
  if (losses_.dropped > told_.dropped)
    text += (text.empty() ? "" : ", ") + part(losses_.dropped, told_.dropped, " was dropped", " were dropped");
  told_ = losses_;
  if (!text.empty())
    log_("outbox is full (" + humanBytes(static_cast<double>(waiting_bytes_)) + "): " + text +
         "; a larger outbox.quota_mb keeps more");
}

}  // namespace comap
