#include "protocol/link/grants.h"

#include <array>

#include "protocol/link/topics.h"

namespace comap {
namespace {

LinkRole linkRoleOf(KeyRole role) {
  return role == KeyRole::kRobot ? LinkRole::kRobot : role == KeyRole::kCore ? LinkRole::kCore : LinkRole::kObserver;
}

std::string element(const std::string& name, const std::string& content) {
  return "<" + name + ">" + content + "</" + name + ">";
}

std::string dateText(std::time_t time) {
  std::tm parts{};
  gmtime_r(&time, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%S", &parts);
  return text.data();
}

std::string topicsText(const std::string& direction, const Participant& participant, const std::string& topics) {
  if (topics.empty()) return {};
  // A robot has nothing but a partition of its own below the site's.
  const bool robot = participant.role == KeyRole::kRobot;
  const std::string partitions =
      robot ? element("partition", participant.site + "/" + participant.name)
            : element("partition", participant.site) + element("partition", participant.site + "/*");
  return element(direction, element("topics", topics) + element("partitions", partitions));
}

const char* const kEveryDomain = "<domains><id_range><min>0</min><max>230</max></id_range></domains>";

}  // namespace

std::string governanceText() {
  const std::string topic_rule =
      element("topic_expression", "comap/*") + element("enable_discovery_protection", "true") +
      element("enable_liveliness_protection", "true") + element("enable_read_access_control", "true") +
      element("enable_write_access_control", "true") +
      // Whole submessages, with a signature for each reader alone, so that no reader can write in the writer's name.
      // Payloads by themselves besides would only take room: Fast DDS keeps 260 bytes of each datagram free for that.
      element("metadata_protection_kind", "ENCRYPT_WITH_ORIGIN_AUTHENTICATION") +
      element("data_protection_kind", "NONE");
  const std::string rule = kEveryDomain + element("allow_unauthenticated_participants", "false") +
                           element("enable_join_access_control", "true") +
                           element("discovery_protection_kind", "ENCRYPT") +
                           element("liveliness_protection_kind", "ENCRYPT") + element("rtps_protection_kind", "NONE") +
                           element("topic_access_rules", element("topic_rule", topic_rule));
  return element("dds", element("domain_access_rules", element("domain_rule", rule)));
}

std::string permissionsText(const Participant& participant, std::time_t from, std::time_t until) {
  const LinkRole role = linkRoleOf(participant.role);
  std::string out, in;
  for (const Topic topic : kAllTopics) {
    if (writes(role, topic)) out += element("topic", topicName(topic));
    // A core looks, as an observer does, whether another one serves its site.
    if (reads(role, topic) || (role == LinkRole::kCore && reads(LinkRole::kObserver, topic)))
      in += element("topic", topicName(topic));
  }
  constexpr std::time_t kDay_s = 86400;  // readers take dates for local time: a day more on each side makes them agree
  const std::string grant = element("subject_name", subjectText(participant)) +
                            element("validity", element("not_before", dateText(from - kDay_s)) +
                                                    element("not_after", dateText(until + kDay_s))) +
                            element("allow_rule", kEveryDomain + topicsText("publish", participant, out) +
                                                      topicsText("subscribe", participant, in)) +
                            element("default", "DENY");
  return element("dds", element("permissions", "<grant name=\"" + participant.name + "\">" + grant + "</grant>"));
}

}  // namespace comap
