// OpenSSL's objects with owners, and its errors as text. Inside this folder only.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <string_view>

#include "protocol/types/result.h"

namespace comap {

template <auto kFree>
struct FreeWith {
  template <class T>
  void operator()(T* object) const {
    kFree(object);
  }
};
inline void freeBio(BIO* bio) { BIO_free(bio); }

using BioHandle = std::unique_ptr<BIO, FreeWith<freeBio>>;
using CertificateHandle = std::unique_ptr<X509, FreeWith<X509_free>>;
using CrlHandle = std::unique_ptr<X509_CRL, FreeWith<X509_CRL_free>>;
using KeyHandle = std::unique_ptr<EVP_PKEY, FreeWith<EVP_PKEY_free>>;
using NameHandle = std::unique_ptr<X509_NAME, FreeWith<X509_NAME_free>>;
using Pkcs7Handle = std::unique_ptr<PKCS7, FreeWith<PKCS7_free>>;
using StoreHandle = std::unique_ptr<X509_STORE, FreeWith<X509_STORE_free>>;
using StoreContextHandle = std::unique_ptr<X509_STORE_CTX, FreeWith<X509_STORE_CTX_free>>;

/// Why the last call of this thread failed; empties OpenSSL's list.
std::string opensslReason();

/// A BIO that reads `text`, which must outlive it; one that is written to; what was written.
BioHandle readerOf(std::string_view text);
BioHandle memoryBio();
std::string contentOf(BIO* bio);

/// PEM texts; errors name `path`, the file they are from, and what was expected: kBadData.
Result<CertificateHandle> parseCertificate(std::string_view pem, const std::string& path);
Result<CrlHandle> parseCrl(std::string_view pem, const std::string& path);
Result<KeyHandle> parseKey(std::string_view pem, const std::string& path);

/// The whole file; kUnreachable naming it; kBadData if it is larger than any of ours (1 MiB).
Result<std::string> readText(const std::string& path);

/// "2028-11-21 14:05 UTC".
std::string utcText(const ASN1_TIME* time);

}  // namespace comap
