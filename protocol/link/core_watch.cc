#include "protocol/link/core_watch.h"

#include <fastdds/rtps/writer/WriterDiscoveryInfo.h>

#include <chrono>
#include <cinttypes>
#include <cstdio>
#include <ctime>
#include <fastdds/dds/core/status/SubscriptionMatchedStatus.hpp>
#include <random>
#include <tuple>

#include "protocol/link/topics.h"

namespace comap {
namespace {

namespace rtps = eprosima::fastrtps::rtps;

constexpr const char *kServes = "serves ", *kListens = "listens ";
constexpr size_t kMostWriters = 256;  // strangers may invent any number

// "since 2026-03-01 12:00:00 UTC", by its own clock.
std::string sinceWhen(const std::string& began) {
  const auto seconds =
      static_cast<std::time_t>(std::strtoull(began.substr(0, 16).c_str(), nullptr, 16) / 1'000'000'000);
  std::tm parts{};
  char text[40] = "";
  if (gmtime_r(&seconds, &parts) != nullptr) std::strftime(text, sizeof text, "since %Y-%m-%d %H:%M:%S UTC", &parts);
  return text;
}

}  // namespace

CoreRank newCoreRank() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const auto ns = static_cast<uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count());
  char text[25];
  std::snprintf(text, sizeof text, "%016" PRIx64 "%08x", ns, static_cast<unsigned>(std::random_device{}()));
  return {false, text};
}

bool staysBefore(const CoreRank& a, const CoreRank& b) {
  return std::tuple(!a.serves, a.began) < std::tuple(!b.serves, b.began);
}

std::string textOf(const CoreRank& rank) { return (rank.serves ? kServes : kListens) + rank.began; }

CoreRank rankOf(const std::string& text) {
  for (const std::string word : {kServes, kListens}) {
    const std::string began = text.starts_with(word) ? text.substr(word.size()) : "";
    if (began.size() == 24 && began.find_first_not_of("0123456789abcdef") == std::string::npos)
      return {word == kServes, began};
  }
  return {true, ""};
}

CoreWatch::CoreWatch(const DdsLinkOptions& options) : JoinWatch(options) {}

void CoreWatch::on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*, rtps::WriterDiscoveryInfo&& info) {
  if (info.info.topicName().to_string() != topicName(Topic::kCoreStatus)) return;
  const std::lock_guard lock(mutex_);
  if (info.status == rtps::WriterDiscoveryInfo::REMOVED_WRITER) {
    announced_.erase(info.info.guid());
    return;
  }
  const auto& data = info.info.m_qos.m_userData.data_vec();
  if (announced_.size() < kMostWriters || announced_.contains(info.info.guid()))
    announced_[info.info.guid()] = rankOf({data.begin(), data.end()});
}

void CoreWatch::on_subscription_matched(eprosima::fastdds::dds::DataReader*,
                                        const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) {
  const Guid writer = rtps::iHandle2GUID(status.last_publication_handle);
  const std::lock_guard lock(mutex_);
  if (status.current_count_change > 0)
    matched_.insert(writer);
  else
    matched_.erase(writer);
}

bool CoreWatch::knowsAll() const {
  auto unknown = coresInSight();
  const std::lock_guard lock(mutex_);
  for (const auto& [writer, rank] : announced_) unknown.erase(writer.guidPrefix);
  return unknown.empty();
}

std::string CoreWatch::elder(const CoreRank& own) const {
  const std::lock_guard lock(mutex_);
  for (const auto& [writer, rank] : announced_) {
    // A link of this very core may be left, which did not close.
    if (!matched_.contains(writer) || rank.began == own.began || !staysBefore(rank, own)) continue;
    return rank.began.empty() ? "another mapping core, of an older release"
                              : "another mapping core, there " + sinceWhen(rank.began);
  }
  return {};
}

}  // namespace comap
