#include "protocol/keys/credentials.h"

#include <openssl/bn.h>
#include <openssl/x509_vfy.h>
#include <sys/stat.h>

#include <algorithm>

#include "protocol/keys/openssl_handles.h"
#include "protocol/keys/signed_text.h"
#include "protocol/keys/subject_name.h"

namespace comap {
namespace {

// The parsed half of a folder that factsOf and checkCredentials need.
struct Parsed {
  std::string authority_pem;
  CertificateHandle authority, certificate;
  CrlHandle revoked;
};

Result<Parsed> parse(const Credentials& files) {
  Parsed parsed;
  auto authority = readText(files.authority);
  if (!authority) return authority.error();
  parsed.authority_pem = std::move(*authority);
  auto authority_certificate = parseCertificate(parsed.authority_pem, files.authority);
  if (!authority_certificate) return authority_certificate.error();
  parsed.authority = std::move(*authority_certificate);
  const auto certificate_pem = readText(files.certificate);
  if (!certificate_pem) return certificate_pem.error();
  auto certificate = parseCertificate(*certificate_pem, files.certificate);
  if (!certificate) return certificate.error();
  parsed.certificate = std::move(*certificate);
  const auto revoked_pem = readText(files.revoked);
  if (!revoked_pem) return revoked_pem.error();
  auto revoked = parseCrl(*revoked_pem, files.revoked);
  if (!revoked) return revoked.error();
  parsed.revoked = std::move(*revoked);
  return parsed;
}

std::string hexOf(const ASN1_INTEGER* number) {
  const std::unique_ptr<BIGNUM, FreeWith<BN_free>> value(ASN1_INTEGER_to_BN(number, nullptr));
  char* hex = BN_bn2hex(value.get());
  std::string text = hex != nullptr ? hex : "";
  OPENSSL_free(hex);
  return text;
}

std::time_t endOf(const X509* certificate) {
  std::tm parts{};
  return ASN1_TIME_to_tm(X509_get0_notAfter(certificate), &parts) == 1 ? timegm(&parts) : 0;
}

std::set<std::string> serialsIn(X509_CRL* list) {
  std::set<std::string> serials;
  const auto* entries = X509_CRL_get_REVOKED(list);
  for (int i = 0; i < sk_X509_REVOKED_num(entries); ++i)
    serials.insert(hexOf(X509_REVOKED_get0_serialNumber(sk_X509_REVOKED_value(entries, i))));
  return serials;
}

// OpenSSL's verdict on the certificate, in the words of who has to act on it; empty if it counts.
std::string refusalOf(const Parsed& parsed, const Credentials& files, std::time_t now, bool& revoked) {
  const StoreHandle store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), parsed.authority.get());
  X509_STORE_add_crl(store.get(), parsed.revoked.get());
  const StoreContextHandle context(X509_STORE_CTX_new());
  X509_STORE_CTX_init(context.get(), store.get(), parsed.certificate.get(), nullptr);
  X509_STORE_CTX_set_time(context.get(), 0, now);
  X509_STORE_CTX_set_flags(context.get(), X509_V_FLAG_CRL_CHECK | X509_V_FLAG_CHECK_SS_SIGNATURE);
  if (X509_verify_cert(context.get()) == 1) return {};
  const int code = X509_STORE_CTX_get_error(context.get());
  revoked = code == X509_V_ERR_CERT_REVOKED;
  const bool of_authority = X509_STORE_CTX_get_error_depth(context.get()) > 0;
  const X509* judged = of_authority ? parsed.authority.get() : parsed.certificate.get();
  const std::string& path = of_authority ? files.authority : files.certificate;
  switch (code) {
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return path + ": expired on " + utcText(X509_get0_notAfter(judged)) + ": issue new keys with 'fleet keys'";
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return path + ": not valid before " + utcText(X509_get0_notBefore(judged)) + ": is this machine's clock right?";
    case X509_V_ERR_CERT_REVOKED:
      return path + ": revoked, says " + files.revoked;
    case X509_V_ERR_CRL_HAS_EXPIRED:  // good as long as the authority, and judged before it
      return files.authority + ": expired on " + utcText(X509_get0_notAfter(parsed.authority.get())) +
             ": make the site's keys anew with 'fleet keys'";
    case X509_V_ERR_CRL_SIGNATURE_FAILURE:
    case X509_V_ERR_UNABLE_TO_GET_CRL:
    case X509_V_ERR_CRL_NOT_YET_VALID:
      return files.revoked + ": is not of the authority in " + files.authority + ", or not yet valid (" +
             X509_verify_cert_error_string(code) + ")";
    default:
      return path + ": the authority in " + files.authority + " did not sign it (" +
             X509_verify_cert_error_string(code) + "): are the files of one and the same site?";
  }
}

Result<void> checkKey(const Parsed& parsed, const Credentials& files) {
  struct stat status {};
  if (stat(files.key.c_str(), &status) == 0 && (status.st_mode & 077) != 0)
    return Error{ErrorCode::kBadData, files.key + ": others can read this private key: chmod 600 it"};
  const auto pem = readText(files.key);
  if (!pem) return pem.error();
  const auto key = parseKey(*pem, files.key);
  if (!key) return key.error();
  if (X509_check_private_key(parsed.certificate.get(), key->get()) != 1)
    return Error{ErrorCode::kBadData, files.key + ": not the key of " + files.certificate};
  return {};
}

Result<void> checkDocuments(const Parsed& parsed, const Credentials& files, const Participant& participant) {
  for (const std::string& path : {files.governance, files.permissions}) {
    const auto text = readText(path);
    if (!text) return text.error();
    const auto document = verifySignedText(*text, parsed.authority_pem, path);
    if (!document) return document.error();
    if (path == files.permissions &&
        document->find("<subject_name>" + subjectText(participant) + "</subject_name>") == std::string::npos)
      return Error{ErrorCode::kBadData, path + ": grants nothing to " + describe(participant) +
                                            ", whose certificate is " + files.certificate};
  }
  return {};
}

}  // namespace

Credentials credentialsIn(const std::string& folder) {
  return {folder + "/authority.pem",  folder + "/certificate.pem", folder + "/key.pem",
          folder + "/governance.p7s", folder + "/permissions.p7s", folder + "/revoked.pem"};
}

std::string announcedAuthority(const Credentials& credentials) {
  const auto pem = readText(credentials.authority);
  if (!pem) return {};
  const auto certificate = parseCertificate(*pem, credentials.authority);
  if (!certificate) return {};
  char* line = X509_NAME_oneline(X509_get_subject_name(certificate->get()), nullptr, 0);
  std::string text = line != nullptr ? line : "";
  OPENSSL_free(line);
  return text;
}

Result<CertificateFacts> factsOf(const Credentials& credentials, std::time_t now) {
  const auto parsed = parse(credentials);
  if (!parsed) return parsed.error();
  const X509* certificate = parsed->certificate.get();
  const auto participant = participantOf(X509_get_subject_name(certificate), credentials.certificate);
  if (!participant) return participant.error();
  CertificateFacts facts{*participant,
                         utcText(X509_get0_notBefore(certificate)),
                         utcText(X509_get0_notAfter(certificate)),
                         hexOf(X509_get0_serialNumber(certificate)),
                         {},
                         0,
                         false,
                         serialsIn(parsed->revoked.get())};
  facts.refusal = refusalOf(*parsed, credentials, now, facts.revoked);
  facts.expires = std::min(endOf(certificate), endOf(parsed->authority.get()));
  return facts;
}

Result<Participant> checkCredentials(const Credentials& credentials, std::time_t now) {
  const auto parsed = parse(credentials);
  if (!parsed) return parsed.error();
  bool revoked = false;
  if (const std::string refusal = refusalOf(*parsed, credentials, now, revoked); !refusal.empty())
    return Error{ErrorCode::kBadData, refusal};
  const auto participant = participantOf(X509_get_subject_name(parsed->certificate.get()), credentials.certificate);
  if (!participant) return participant.error();
  if (auto checked = checkKey(*parsed, credentials); !checked) return checked.error();
  if (auto checked = checkDocuments(*parsed, credentials, *participant); !checked) return checked.error();
  return *participant;
}

}  // namespace comap
