#include "protocol/keys/signed_text.h"

#include "protocol/keys/openssl_handles.h"

namespace comap {

Result<std::string> signText(std::string_view document, const std::string& certificate_pem,
                             const std::string& key_pem) {
  auto certificate = parseCertificate(certificate_pem, "the authority's certificate");
  if (!certificate) return certificate.error();
  auto key = parseKey(key_pem, "the authority's key");
  if (!key) return key.error();
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_NOSMIMECAP | PKCS7_STREAM;
  const BioHandle in = readerOf(document), out = memoryBio();
  const Pkcs7Handle signature(PKCS7_sign(certificate->get(), key->get(), nullptr, in.get(), kFlags));
  if (!signature || SMIME_write_PKCS7(out.get(), signature.get(), in.get(), kFlags) != 1)
    return Error{ErrorCode::kBadData, "signing failed (" + opensslReason() + ")"};
  return contentOf(out.get());
}

Result<std::string> verifySignedText(std::string_view signed_text, const std::string& authority_pem,
                                     const std::string& path) {
  auto authority = parseCertificate(authority_pem, "the authority's certificate");
  if (!authority) return authority.error();
  const StoreHandle store(X509_STORE_new());
  X509_STORE_add_cert(store.get(), authority->get());
  BIO* content = nullptr;
  const Pkcs7Handle signature(SMIME_read_PKCS7(readerOf(signed_text).get(), &content));
  const BioHandle content_owner(content);
  if (!signature || content == nullptr)
    return Error{ErrorCode::kBadData, path + ": expected a signed document (" + opensslReason() + ")"};
  const BioHandle out = memoryBio();
  if (PKCS7_verify(signature.get(), nullptr, store.get(), content, out.get(), PKCS7_TEXT) != 1)
    return Error{ErrorCode::kBadData,
                 path + ": is not as the authority signed it (" + opensslReason() +
                     "): it was changed, or another authority's key signed it; copy it anew from where 'fleet keys' "
                     "made it"};
  return contentOf(out.get());
}

}  // namespace comap
