// Which other cores serve the same site, and which of them all is to stay. Inside the link only.
#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "protocol/link/security.h"

namespace comap {

/// What a core tells others of its site. `began`: nanoseconds since 1970 and a random number, in hexadecimal digits:
/// of two the smaller one began earlier. Empty: of a release that did not tell.
struct CoreRank {
  bool serves = false;
  std::string began;
};

/// Of a core that begins now, and does not serve yet.
CoreRank newCoreRank();

/// Whether `a` stays where `b` is too: of two that serve, or do not yet, the one that began earlier; else the one that
/// serves. All come to the same answer.
bool staysBefore(const CoreRank& a, const CoreRank& b);

/// As it is announced, and back; what is no rank is a core that serves and tells no more.
std::string textOf(const CoreRank& rank);
CoreRank rankOf(const std::string& text);

/// Listens for the writers of the core's status. A rank counts only if its writer was matched by our reader of that
/// topic: with keys, only a core may write there. Called from DDS's threads.
class CoreWatch : public JoinWatch {
 public:
  explicit CoreWatch(const DdsLinkOptions& options);

  void on_publisher_discovery(eprosima::fastdds::dds::DomainParticipant*,
                              eprosima::fastrtps::rtps::WriterDiscoveryInfo&& info) override;
  void on_subscription_matched(eprosima::fastdds::dds::DataReader*,
                               const eprosima::fastdds::dds::SubscriptionMatchedStatus& status) override;

  /// The core to which `own` gives way, in words; empty if there is none.
  std::string elder(const CoreRank& own) const;
  /// Whether each core in sight has announced itself.
  bool knowsAll() const;

 private:
  using Guid = eprosima::fastrtps::rtps::GUID_t;
  mutable std::mutex mutex_;
  std::map<Guid, CoreRank> announced_;  // by writer
  std::set<Guid> matched_;
};

}  // namespace comap
