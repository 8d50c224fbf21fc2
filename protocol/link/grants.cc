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

// Partitions: the participant's own below the site's, or the whole site.
std::string topicsText(const std::string& direction, const Participant& participant, const std::string& topics,
                       bool own) {
  if (topics.empty()) return {};
  const std::string partitions =
      own ? element("partition", participant.site + "/" + participant.name)
          : element("partition", participant.site) + element("partition", participant.site + "/*");
  return element(direction, element("topics", topics) + element("partitions", partitions));
}

std::string topicRule(const std::string& topics, const std::string& metadata_protection) {
  return element("topic_rule", element("topic_expression", topics) + element("enable_discovery_protection", "true") +
                                   element("enable_liveliness_protection", "true") +
                                   element("enable_read_access_control", "true") +
                                   element("enable_write_access_control", "true") +
                                   // Payloads by themselves besides would only take room: Fast DDS keeps 260 bytes of
                                   // each datagram free for that.
                                   element("metadata_protection_kind", metadata_protection) +
                                   element("data_protection_kind", "NONE"));
}

const char* const kEveryDomain = "<domains><id_range><min>0</min><max>230</max></id_range></domains>";

}  // namespace

std::string governanceText() {
  // Of paced topics a participant has several writers to one reader. Fast DDS 2.9 tells the signatures for each of them
  // apart by the reader alone, so all but one would never learn what has arrived. Nobody but that reader's participant
  // has the writers' key, so it needs no signature of its own.
  std::string topic_rules;
  for (const Topic topic : kAllTopics)
    if (isPaced(topic)) topic_rules += topicRule(topicName(topic), "ENCRYPT");
  // Whole submessages, with a signature for each reader alone, so that no reader can write in the writer's name.
  topic_rules += topicRule("comap/*", "ENCRYPT_WITH_ORIGIN_AUTHENTICATION");
  const std::string rule = kEveryDomain + element("allow_unauthenticated_participants", "false") +
                           element("enable_join_access_control", "true") +
                           element("discovery_protection_kind", "ENCRYPT") +
                           element("liveliness_protection_kind", "ENCRYPT") + element("rtps_protection_kind", "NONE") +
                           element("topic_access_rules", topic_rules);
  return element("dds", element("domain_access_rules", element("domain_rule", rule)));
}

std::string permissionsText(const Participant& participant, std::time_t from, std::time_t until) {
  const LinkRole role = linkRoleOf(participant.role);
  const bool robot = role == LinkRole::kRobot;  // it has nothing but a partition of its own below the site's
  std::string out, in, in_own;
  for (const Topic topic : kAllTopics) {
    if (writes(role, topic)) out += element("topic", topicName(topic));
    // A core looks, as an observer does, whether another one serves its site.
    const bool looks_on = role == LinkRole::kCore && reads(LinkRole::kObserver, topic);
    const bool own = role == LinkRole::kObserver && isForNamedObservers(topic);
    if (reads(role, topic) || looks_on) (own ? in_own : in) += element("topic", topicName(topic));
  }
  constexpr std::time_t kDay_s = 86400;  // readers take dates for local time: a day more on each side makes them agree
  // In rules of their own: Fast DDS takes any partition of a rule for any of its topics.
  const auto rule = [](const std::string& topics) {
    return topics.empty() ? "" : element("allow_rule", kEveryDomain + topics);
  };
  const std::string grant = element("subject_name", subjectText(participant)) +
                            element("validity", element("not_before", dateText(from - kDay_s)) +
                                                    element("not_after", dateText(until + kDay_s))) +
                            rule(topicsText("publish", participant, out, role != LinkRole::kCore) +
                                 topicsText("subscribe", participant, in, robot)) +
                            rule(topicsText("subscribe", participant, in_own, true)) + element("default", "DENY");
  return element("dds", element("permissions", "<grant name=\"" + participant.name + "\">" + grant + "</grant>"));
}

}  // namespace comap
