#include "protocol/link/security.h"

#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>

#include <algorithm>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocol/keys/credentials.h"
#include "protocol/keys/signed_text.h"
#include "protocol/link/grants.h"
#include "protocol/link/topics.h"

namespace comap {
namespace {

namespace dds = eprosima::fastdds::dds;
namespace rtps = eprosima::fastrtps::rtps;

constexpr uint32_t kHandshakeBytes = 16384;
constexpr size_t kMostTold = 256;  // participants: strangers may invent any number
constexpr size_t kMostNameBytes = 64;

const char* const kMakeKeys = ": 'fleet keys' makes such folders";

KeyRole keyRoleOf(LinkRole role) {
  return role == LinkRole::kRobot ? KeyRole::kRobot : role == LinkRole::kCore ? KeyRole::kCore : KeyRole::kTool;
}

}  // namespace

std::string safeName(std::string name) {
  name.resize(std::min(name.size(), kMostNameBytes));
  for (char& c : name)
    if (!(c >= 'a' && c <= 'z') && !(c >= '0' && c <= '9') && c != '_' && c != '-' && c != '/') c = '?';
  return name;
}

namespace {

// All of a site must ask for the same protection, or they do not find each other and nothing says why.
Result<void> checkGovernance(const Credentials& files) {
  const auto contentOf = [](const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  };
  const auto text = verifySignedText(contentOf(files.governance), contentOf(files.authority), files.governance);
  if (!text) return text.error();
  if (text->find(governanceText()) != std::string::npos) return {};
  return Error{ErrorCode::kBadData, "link.keys: " + files.governance +
                                        ": asks for other protection than this program does, as keys of another "
                                        "version: make the site's keys anew with 'fleet keys'"};
}

}  // namespace

Result<void> checkKeys(const DdsLinkOptions& options) {
  if (options.keys.empty()) return {};
  const std::string where = "link.keys '" + options.keys + "'";
  std::error_code ignored;
  if (!std::filesystem::is_directory(options.keys, ignored))
    return Error{ErrorCode::kUnreachable, where + " is no folder that can be read" + kMakeKeys};
  const auto owner = checkCredentials(credentialsIn(options.keys), std::time(nullptr));
  if (!owner) return Error{owner.error().code, "link.keys: " + owner.error().text};
  const bool core_looks_round = options.role == LinkRole::kObserver && owner->role == KeyRole::kCore;
  if (owner->role != keyRoleOf(options.role) && !core_looks_round)
    return Error{ErrorCode::kWrongUse,
                 where + " is of " + describe(*owner) + ", this is a " + keyRoleName(keyRoleOf(options.role))};
  const bool named =
      options.role == LinkRole::kRobot || (options.role == LinkRole::kObserver && !options.robot.empty());
  if (named && owner->name != options.robot)
    return Error{ErrorCode::kWrongUse, where + " is of " + describe(*owner) + ", this " +
                                           keyRoleName(keyRoleOf(options.role)) + " is '" + options.robot + "'"};
  if (owner->site != options.site)
    return Error{ErrorCode::kWrongUse,
                 where + " is of " + describe(*owner) + ", but link.site is '" + options.site + "'"};
  return checkGovernance(credentialsIn(options.keys));
}

void secure(const DdsLinkOptions& options, eprosima::fastdds::dds::DomainParticipantQos& qos) {
  if (options.keys.empty()) return;
  const Credentials files = credentialsIn(std::filesystem::absolute(options.keys).string());
  auto& properties = qos.properties().properties();
  const auto set = [&](const char* name, const std::string& value) { properties.emplace_back(name, value); };
  const auto setFile = [&](const char* name, const std::string& path) { set(name, "file://" + path); };
  set("dds.sec.auth.plugin", "builtin.PKI-DH");
  setFile("dds.sec.auth.builtin.PKI-DH.identity_ca", files.authority);
  setFile("dds.sec.auth.builtin.PKI-DH.identity_certificate", files.certificate);
  setFile("dds.sec.auth.builtin.PKI-DH.identity_crl", options.revoked.empty() ? files.revoked : options.revoked);
  setFile("dds.sec.auth.builtin.PKI-DH.private_key", files.key);
  set("dds.sec.access.plugin", "builtin.Access-Permissions");
  setFile("dds.sec.access.builtin.Access-Permissions.permissions_ca", files.authority);
  setFile("dds.sec.access.builtin.Access-Permissions.governance", files.governance);
  setFile("dds.sec.access.builtin.Access-Permissions.permissions", files.permissions);
  set("dds.sec.crypto.plugin", "builtin.AES-GCM-GMAC");
}

HandshakeRoom::HandshakeRoom(const DdsLinkOptions& options) {
  if (options.keys.empty()) return;
  dds::DomainParticipantQos qos;
  auto udp = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  udp->interfaceWhiteList.push_back(options.interface_address);
  udp->maxMessageSize = kHandshakeBytes;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(udp);
  qos.wire_protocol().builtin.discovery_config.discoveryProtocol = rtps::DiscoveryProtocol_t::NONE;
  secure(options, qos);
  participant_ =
      dds::DomainParticipantFactory::get_instance()->create_participant(static_cast<uint32_t>(options.domain), qos);
}

HandshakeRoom::~HandshakeRoom() {
  if (participant_ != nullptr) dds::DomainParticipantFactory::get_instance()->delete_participant(participant_);
}

bool Authorship::isOf(const rtps::GuidPrefix_t& writer, KeyRole role, const std::string& name) const {
  if (!secured_) return true;
  const auto start = guidStart({site_, role, name});
  return std::equal(start.begin(), start.end(), std::begin(writer.value));
}

JoinWatch::JoinWatch(const DdsLinkOptions& options)
    : secured_(!options.keys.empty()),
      authority_(secured_ ? announcedAuthority(credentialsIn(options.keys)) : ""),
      notice_(options.notice) {}

void JoinWatch::onParticipantAuthentication(eprosima::fastdds::dds::DomainParticipant*,
                                            rtps::ParticipantAuthenticationInfo&& info) {
  if (info.status != rtps::ParticipantAuthenticationInfo::UNAUTHORIZED_PARTICIPANT) return;
  tellOnce(info.guid.guidPrefix,
           nameOf(info.guid.guidPrefix) +
               " was not let in: its certificate is revoked, expired or of another authority, or its "
               "permissions were changed ('fleet keys show' tells on its machine; is the clock of this one right?)");
}

void JoinWatch::on_participant_discovery(eprosima::fastdds::dds::DomainParticipant*,
                                         rtps::ParticipantDiscoveryInfo&& info) {
  const bool gone = info.status == rtps::ParticipantDiscoveryInfo::REMOVED_PARTICIPANT ||
                    info.status == rtps::ParticipantDiscoveryInfo::DROPPED_PARTICIPANT;
  const std::string name = safeName(info.info.m_participantName.to_string());
  {
    const std::lock_guard lock(mutex_);
    if (gone) names_.erase(info.info.m_guid.guidPrefix);
    if (gone) cores_.erase(info.info.m_guid.guidPrefix);
    if (!gone && names_.size() < kMostTold) names_[info.info.m_guid.guidPrefix] = name;
  }
  if (info.status != rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT) return;
  if (!name.starts_with("comap/")) return;  // other programs may share the domain
  const bool peer_secured = info.info.security_attributes_ != 0;
  const auto& who = info.info.m_guid.guidPrefix;
  if (peer_secured != secured_) {
    tellOnce(who, secured_ ? name + " has no keys (link.keys) and was not let in"
                           : name + " wants keys and this program has none: give link.keys");
    return;
  }
  const std::string* authority = rtps::DataHolderHelper::find_property_value(info.info.identity_token_, "dds.ca.sn");
  if (secured_ && authority != nullptr && *authority != authority_) {
    tellOnce(who, name + " has keys of another authority and was not let in: make its keys with this site's");
  } else if (name == "comap/" + roleName(LinkRole::kCore)) {
    const std::lock_guard lock(mutex_);
    if (cores_.size() < kMostTold) cores_.emplace(who, std::chrono::steady_clock::now());
  }
}

std::optional<std::chrono::steady_clock::duration> JoinWatch::coreInSight() const {
  const std::lock_guard lock(mutex_);
  std::optional<std::chrono::steady_clock::duration> longest;
  for (const auto& [who, since] : cores_) {
    const auto now = std::chrono::steady_clock::now() - since;
    if (!longest || now > *longest) longest = now;
  }
  return longest;
}

std::set<rtps::GuidPrefix_t> JoinWatch::coresInSight() const {
  const std::lock_guard lock(mutex_);
  std::set<rtps::GuidPrefix_t> cores;
  for (const auto& [who, since] : cores_) cores.insert(who);
  return cores;
}

std::string JoinWatch::nameOf(const rtps::GuidPrefix_t& who) {
  const std::lock_guard lock(mutex_);
  const auto it = names_.find(who);
  return it == names_.end() ? "a participant with keys" : it->second;
}

void JoinWatch::tellOnce(const rtps::GuidPrefix_t& who, const std::string& text) {
  {
    const std::lock_guard lock(mutex_);
    if (told_.size() >= kMostTold || !told_.insert(who).second) return;
  }
  if (notice_) notice_(text);
}

}  // namespace comap
