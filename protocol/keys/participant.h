// Who a certificate is for: its subject name, in the one form that certificates and permissions use.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "protocol/types/result.h"

namespace comap {

enum class KeyRole : uint8_t { kRobot, kCore, kTool };

struct Participant {
  std::string site;
  KeyRole role = KeyRole::kRobot;
  std::string name;  ///< unique in the site, over all roles
};

/// "robot", "core", "tool".
std::string keyRoleName(KeyRole role);

/// "robot 'a' of site 'flat'".
std::string describe(const Participant& participant);

/// What is wrong with a site name for keys (1-64 of A-Z a-z 0-9 _ - .), or a participant's (as robot names); or empty.
std::string keySiteProblem(const std::string& site);
std::string keyNameProblem(const std::string& name);

/// "CN=a,OU=robot,O=flat": RFC 2253, the order in which permissions must have it.
std::string subjectText(const Participant& participant);

/// The first six bytes of the GUID of every DDS participant that has authenticated itself with a certificate of this
/// subject: the highest bit, then 47 bits of the SHA-256 of the encoded subject (DDS Security 1.1, 9.3.3).
std::array<uint8_t, 6> guidStart(const Participant& participant);

}  // namespace comap
