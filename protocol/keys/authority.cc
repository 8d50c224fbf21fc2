#include "protocol/keys/authority.h"

#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include "protocol/keys/openssl_handles.h"
#include "protocol/keys/signed_text.h"
#include "protocol/keys/subject_name.h"

namespace comap {
namespace {

Error failed(const std::string& what) { return {ErrorCode::kBadData, what + " failed (" + opensslReason() + ")"}; }

std::string pemOf(X509* certificate) {
  const BioHandle out = memoryBio();
  PEM_write_bio_X509(out.get(), certificate);
  return contentOf(out.get());
}

std::string pemOf(EVP_PKEY* key) {
  const BioHandle out = memoryBio();
  PEM_write_bio_PrivateKey(out.get(), key, nullptr, nullptr, 0, nullptr, nullptr);
  return contentOf(out.get());
}

bool extend(X509* certificate, X509* issuer, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, nid, value);
  const bool added = extension != nullptr && X509_add_ext(certificate, extension, -1) == 1;
  X509_EXTENSION_free(extension);
  return added;
}

// What both kinds of certificate have.
Result<CertificateHandle> draft(X509_NAME* subject, EVP_PKEY* key, Validity validity) {
  CertificateHandle certificate(X509_new());
  uint64_t serial = 0;
  if (!certificate || RAND_bytes(reinterpret_cast<unsigned char*>(&serial), sizeof serial) != 1)
    return failed("making a certificate");
  serial >>= 1;  // a serial number is positive
  X509_set_version(certificate.get(), X509_VERSION_3);
  ASN1_INTEGER_set_uint64(X509_get_serialNumber(certificate.get()), serial);
  X509_set_subject_name(certificate.get(), subject);
  X509_set_pubkey(certificate.get(), key);
  ASN1_TIME_set(X509_getm_notBefore(certificate.get()), validity.from);
  ASN1_TIME_set(X509_getm_notAfter(certificate.get()), validity.until);
  return certificate;
}

// Never the same twice: participants of two authorities tell each other apart by it before they say anything else.
Result<NameHandle> authorityName(const std::string& site) {
  std::array<unsigned char, 4> random{};
  if (RAND_bytes(random.data(), random.size()) != 1) return failed("making the authority's name");
  std::string common = "authority-";
  for (const unsigned char byte : random) common += {"0123456789abcdef"[byte >> 4], "0123456789abcdef"[byte & 15]};
  NameHandle name(X509_NAME_new());
  for (const auto& [nid, text] :
       {std::pair<int, std::string>(NID_organizationName, site), std::pair<int, std::string>(NID_commonName, common)})
    X509_NAME_add_entry_by_NID(name.get(), nid, V_ASN1_UTF8STRING, reinterpret_cast<const unsigned char*>(text.data()),
                               static_cast<int>(text.size()), -1, 0);
  return name;
}

// Dated from now on, and good for as long as the authority: who replaces it says when it is too old.
Result<std::string> signedCrl(X509_CRL* crl, X509* authority, EVP_PKEY* key) {
  const std::unique_ptr<ASN1_TIME, FreeWith<ASN1_TIME_free>> now(ASN1_TIME_set(nullptr, std::time(nullptr) - 60));
  X509_CRL_set1_lastUpdate(crl, now.get());
  X509_CRL_set1_nextUpdate(crl, X509_get0_notAfter(authority));
  X509_CRL_sort(crl);
  if (X509_CRL_sign(crl, key, EVP_sha256()) == 0) return failed("signing the list of revoked certificates");
  const BioHandle out = memoryBio();
  PEM_write_bio_X509_CRL(out.get(), crl);
  return contentOf(out.get());
}

}  // namespace

Result<Authority> Authority::create(const std::string& site, Validity validity) {
  if (const std::string problem = keySiteProblem(site); !problem.empty()) return Error{ErrorCode::kWrongUse, problem};
  const KeyHandle key(EVP_EC_gen("P-256"));
  if (!key) return failed("making a key");
  const auto name = authorityName(site);
  if (!name) return name.error();
  auto certificate = draft(name->get(), key.get(), validity);
  if (!certificate) return certificate.error();
  X509* own = certificate->get();
  X509_set_issuer_name(own, name->get());
  if (!extend(own, own, NID_basic_constraints, "critical,CA:TRUE,pathlen:0") ||
      !extend(own, own, NID_key_usage, "critical,keyCertSign,cRLSign,digitalSignature") ||
      X509_sign(own, key.get(), EVP_sha256()) == 0)
    return failed("making the authority's certificate");
  return Authority(site, pemOf(own), pemOf(key.get()));
}

Result<Authority> Authority::fromPem(const std::string& certificate, const std::string& key) {
  auto parsed = parseCertificate(certificate, "the authority's certificate");
  if (!parsed) return parsed.error();
  auto parsed_key = parseKey(key, "the authority's key");
  if (!parsed_key) return parsed_key.error();
  if (X509_check_private_key(parsed->get(), parsed_key->get()) != 1)
    return Error{ErrorCode::kBadData, "the authority's key is not that of its certificate"};
  const X509_NAME* subject = X509_get_subject_name(parsed->get());
  std::array<char, 128> site{};
  X509_NAME_get_text_by_NID(const_cast<X509_NAME*>(subject), NID_organizationName, site.data(), site.size());
  if (X509_check_ca(parsed->get()) == 0 || !keySiteProblem(site.data()).empty())
    return Error{ErrorCode::kBadData, "the authority's certificate is none that 'fleet keys init' has made"};
  return Authority(site.data(), certificate, key);
}

Result<IssuedKey> Authority::issue(const Participant& participant, Validity validity) const {
  if (const std::string problem = keyNameProblem(participant.name); !problem.empty())
    return Error{ErrorCode::kWrongUse, problem};
  if (participant.site != site_)
    return Error{ErrorCode::kWrongUse, "the authority is of site '" + site_ + "', not '" + participant.site + "'"};
  auto authority = parseCertificate(certificate_, "the authority's certificate");
  auto authority_key = parseKey(key_, "the authority's key");
  if (!authority) return authority.error();
  if (!authority_key) return authority_key.error();
  const KeyHandle key(EVP_EC_gen("P-256"));
  if (!key) return failed("making a key");
  auto certificate = draft(subjectName(participant).get(), key.get(), validity);
  if (!certificate) return certificate.error();
  X509* own = certificate->get();
  X509_set_issuer_name(own, X509_get_subject_name(authority->get()));
  // Documents are believed if a certificate signed them that the authority has signed: neither use lets this one sign.
  if (!extend(own, authority->get(), NID_basic_constraints, "critical,CA:FALSE") ||
      !extend(own, authority->get(), NID_key_usage, "critical,keyAgreement") ||
      !extend(own, authority->get(), NID_ext_key_usage, "clientAuth") ||
      X509_sign(own, authority_key->get(), EVP_sha256()) == 0)
    return failed("making the certificate of " + describe(participant));
  return IssuedKey{pemOf(own), pemOf(key.get())};
}

Result<std::string> Authority::sign(std::string_view document) const { return signText(document, certificate_, key_); }

Result<std::string> Authority::emptyRevocations() const {
  auto authority = parseCertificate(certificate_, "the authority's certificate");
  auto key = parseKey(key_, "the authority's key");
  if (!authority) return authority.error();
  if (!key) return key.error();
  const CrlHandle crl(X509_CRL_new());
  X509_CRL_set_version(crl.get(), X509_CRL_VERSION_2);
  X509_CRL_set_issuer_name(crl.get(), X509_get_subject_name(authority->get()));
  return signedCrl(crl.get(), authority->get(), key->get());
}

Result<std::string> Authority::revoke(const std::string& revocations, const std::string& certificate) const {
  auto authority = parseCertificate(certificate_, "the authority's certificate");
  auto key = parseKey(key_, "the authority's key");
  auto crl = parseCrl(revocations, "the list of revoked certificates");
  auto revoked = parseCertificate(certificate, "the certificate to revoke");
  if (!authority) return authority.error();
  if (!key) return key.error();
  if (!crl) return crl.error();
  if (!revoked) return revoked.error();
  std::unique_ptr<X509_REVOKED, FreeWith<X509_REVOKED_free>> entry(X509_REVOKED_new());
  const std::unique_ptr<ASN1_TIME, FreeWith<ASN1_TIME_free>> now(ASN1_TIME_set(nullptr, std::time(nullptr)));
  if (!entry || !now || X509_REVOKED_set_serialNumber(entry.get(), X509_get_serialNumber(revoked->get())) != 1 ||
      X509_REVOKED_set_revocationDate(entry.get(), now.get()) != 1 ||
      X509_CRL_add0_revoked(crl->get(), entry.get()) != 1)
    return failed("adding to the list of revoked certificates");
  entry.release();  // the list's now
  return signedCrl(crl->get(), authority->get(), key->get());
}

}  // namespace comap
