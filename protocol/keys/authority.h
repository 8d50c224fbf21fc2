// A site's authority: its key says who belongs to the site and what each may do.
#pragma once

#include <ctime>
#include <string>
#include <string_view>

#include "protocol/keys/participant.h"
#include "protocol/types/result.h"

namespace comap {

struct Validity {
  std::time_t from = 0, until = 0;
};

/// PEM texts.
struct IssuedKey {
  std::string certificate, key;
};

/// Values in, values out: nothing is read or written here. EC P-256 and SHA-256 throughout.
class Authority {
 public:
  /// A new authority with a new key. The list of revoked certificates begins empty.
  static Result<Authority> create(const std::string& site, Validity validity);
  /// kBadData if certificate and key do not belong together or are no authority's.
  static Result<Authority> fromPem(const std::string& certificate, const std::string& key);

  const std::string& site() const { return site_; }
  const std::string& certificatePem() const { return certificate_; }
  const std::string& keyPem() const { return key_; }

  /// A new key and its certificate, which may prove who it is and sign nothing.
  Result<IssuedKey> issue(const Participant& participant, Validity validity) const;
  /// `document` in the form that verifySignedText takes.
  Result<std::string> sign(std::string_view document) const;
  /// The empty list of revoked certificates.
  Result<std::string> emptyRevocations() const;
  /// `revocations` with one certificate more.
  Result<std::string> revoke(const std::string& revocations, const std::string& certificate) const;

 private:
  Authority(std::string site, std::string certificate, std::string key)
      : site_(std::move(site)), certificate_(std::move(certificate)), key_(std::move(key)) {}

  std::string site_, certificate_, key_;
};

}  // namespace comap
