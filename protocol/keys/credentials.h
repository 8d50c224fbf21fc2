// The folder of files with which one participant proves who it is, and whether they will do.
#pragma once

#include <ctime>
#include <set>
#include <string>

#include "protocol/keys/participant.h"
#include "protocol/types/result.h"

namespace comap {

/// Paths. `fleet keys` makes such a folder; to change one file breaks the rest.
struct Credentials {
  std::string authority;    ///< certificate of the site's authority
  std::string certificate;  ///< the participant's
  std::string key;          ///< its private key, readable for its owner alone
  std::string governance;   ///< what is encrypted; signed
  std::string permissions;  ///< what the participant may publish and subscribe; signed
  std::string revoked;      ///< certificates that count no longer
};

Credentials credentialsIn(const std::string& folder);

struct CertificateFacts {
  Participant participant;
  std::string valid_from, valid_until;  ///< UTC
  std::string serial;                   ///< hexadecimal
  std::string refusal;                  ///< why it does not count now; empty: it does
  std::time_t expires = 0;              ///< when it or its authority's certificate does, whichever is first
  bool revoked = false;                 ///< that is why
  std::set<std::string> all_revoked;    ///< serials in the list of revoked certificates
};

/// The participant's certificate against its authority, the list of revoked ones and the clock.
Result<CertificateFacts> factsOf(const Credentials& credentials, std::time_t now);

/// The authority's subject as DDS announces it ("/O=flat/CN=authority-1f2e3d4c"); empty if it cannot be read.
std::string announcedAuthority(const Credentials& credentials);

/// Everything that DDS would refuse without saying why, in a sentence that says what to check: missing files, a key
/// that others can read or that is another's, a certificate that is expired, revoked or of another authority, documents
/// that were changed or are another's. Returns whose they are. kUnreachable: cannot be read; kBadData: will not do.
Result<Participant> checkCredentials(const Credentials& credentials, std::time_t now);

}  // namespace comap
