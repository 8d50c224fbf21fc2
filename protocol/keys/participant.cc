#include "protocol/keys/participant.h"

#include <openssl/sha.h>

#include <algorithm>

#include "protocol/keys/subject_name.h"
#include "protocol/types/ids.h"

namespace comap {
namespace {

constexpr std::array kRoles = {KeyRole::kRobot, KeyRole::kCore, KeyRole::kTool};

std::string entryOf(const X509_NAME* name, int nid) {
  const int at = X509_NAME_get_index_by_NID(name, nid, -1);
  if (at < 0) return {};
  unsigned char* utf8 = nullptr;
  const int size = ASN1_STRING_to_UTF8(&utf8, X509_NAME_ENTRY_get_data(X509_NAME_get_entry(name, at)));
  if (size < 0) return {};
  std::string text(reinterpret_cast<char*>(utf8), static_cast<size_t>(size));
  OPENSSL_free(utf8);
  return text;
}

void addEntry(X509_NAME* name, int nid, const std::string& text) {
  X509_NAME_add_entry_by_NID(name, nid, V_ASN1_UTF8STRING, reinterpret_cast<const unsigned char*>(text.data()),
                             static_cast<int>(text.size()), -1, 0);
}

}  // namespace

std::string keyRoleName(KeyRole role) {
  return role == KeyRole::kRobot ? "robot" : role == KeyRole::kCore ? "core" : "tool";
}

std::string describe(const Participant& participant) {
  return keyRoleName(participant.role) + " '" + participant.name + "' of site '" + participant.site + "'";
}

std::string keySiteProblem(const std::string& site) {
  const bool plain = std::all_of(site.begin(), site.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
           c == '.';
  });
  if (!site.empty() && site.size() <= 64 && plain) return {};
  return "site '" + site.substr(0, 64) + "': keys need a name of 1-64 characters of A-Z a-z 0-9 _ - .";
}

std::string keyNameProblem(const std::string& name) { return robotNameProblem(name); }

std::string subjectText(const Participant& participant) {
  return "CN=" + participant.name + ",OU=" + keyRoleName(participant.role) + ",O=" + participant.site;
}

NameHandle subjectName(const Participant& participant) {
  NameHandle name(X509_NAME_new());
  addEntry(name.get(), NID_organizationName, participant.site);
  addEntry(name.get(), NID_organizationalUnitName, keyRoleName(participant.role));
  addEntry(name.get(), NID_commonName, participant.name);
  return name;
}

Result<Participant> participantOf(const X509_NAME* subject, const std::string& path) {
  Participant participant;
  participant.site = entryOf(subject, NID_organizationName);
  participant.name = entryOf(subject, NID_commonName);
  const std::string role = entryOf(subject, NID_organizationalUnitName);
  for (const KeyRole each : kRoles)
    if (role == keyRoleName(each)) participant.role = each;
  // Compared whole: nothing may stand beside the three entries.
  if (keySiteProblem(participant.site).empty() && keyNameProblem(participant.name).empty() &&
      X509_NAME_cmp(subjectName(participant).get(), subject) == 0)
    return participant;
  return Error{ErrorCode::kBadData, path +
                                        ": its subject is not of the form CN=NAME,OU=robot|core|tool,O=SITE that "
                                        "'fleet keys' gives"};
}

std::array<uint8_t, 6> guidStart(const Participant& participant) {
  std::array<uint8_t, SHA256_DIGEST_LENGTH> digest{};
  unsigned length = 0;
  X509_NAME_digest(subjectName(participant).get(), EVP_sha256(), digest.data(), &length);
  std::array<uint8_t, 6> start{};
  for (size_t i = 0; i < start.size(); ++i)
    start[i] = static_cast<uint8_t>((i == 0 ? 0x80 : digest[i - 1] << 7) | digest[i] >> 1);
  return start;
}

}  // namespace comap
