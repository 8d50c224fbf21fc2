#include "protocol/keys/openssl_handles.h"

#include <openssl/err.h>
#include <openssl/pem.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr std::streamsize kLargestFileBytes = 1 << 20;

Error notA(const char* what, const std::string& path) {
  const std::string reason = opensslReason();
  return {ErrorCode::kBadData, path + ": expected " + what + " in PEM (" + reason + ")"};
}

// A key with a passphrase would make OpenSSL ask on the terminal.
int noPassphrase(char*, int, int, void*) { return -1; }

}  // namespace

std::string opensslReason() {
  const unsigned long code = ERR_peek_last_error();
  std::array<char, 256> text{};
  ERR_error_string_n(code, text.data(), text.size());
  const char* reason = code == 0 ? "no reason given" : ERR_reason_error_string(code);
  std::string result = reason != nullptr ? reason : text.data();
  ERR_clear_error();
  return result;
}

BioHandle readerOf(std::string_view text) {
  return BioHandle(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

BioHandle memoryBio() { return BioHandle(BIO_new(BIO_s_mem())); }

std::string contentOf(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return size > 0 ? std::string(data, static_cast<size_t>(size)) : std::string();
}

Result<CertificateHandle> parseCertificate(std::string_view pem, const std::string& path) {
  CertificateHandle certificate(PEM_read_bio_X509(readerOf(pem).get(), nullptr, noPassphrase, nullptr));
  if (!certificate) return notA("a certificate", path);
  return certificate;
}

Result<CrlHandle> parseCrl(std::string_view pem, const std::string& path) {
  CrlHandle crl(PEM_read_bio_X509_CRL(readerOf(pem).get(), nullptr, noPassphrase, nullptr));
  if (!crl) return notA("a list of revoked certificates", path);
  return crl;
}

Result<KeyHandle> parseKey(std::string_view pem, const std::string& path) {
  KeyHandle key(PEM_read_bio_PrivateKey(readerOf(pem).get(), nullptr, noPassphrase, nullptr));
  if (!key) return notA("a private key without passphrase", path);
  return key;
}

Result<std::string> readText(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": " + std::strerror(errno)};
  std::string text(static_cast<size_t>(kLargestFileBytes) + 1, '\0');
  file.read(text.data(), kLargestFileBytes + 1);
  if (file.bad()) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  if (file.gcount() > kLargestFileBytes)
    return Error{ErrorCode::kBadData, path + ": larger than any key or document (1 MiB)"};
  text.resize(static_cast<size_t>(file.gcount()));
  return text;
}

std::string utcText(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) return "an unreadable time";
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M UTC", &parts);
  return text.data();
}

}  // namespace comap
