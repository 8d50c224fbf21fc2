#include "protocol/keys/digest.h"

#include <openssl/hmac.h>

#include <algorithm>

namespace comap {

std::array<uint8_t, 16> authenticationCode(std::span<const uint8_t> key, std::span<const uint8_t> message) {
  std::array<uint8_t, EVP_MAX_MD_SIZE> whole{};
  unsigned size = 0;
  HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()), message.data(), message.size(), whole.data(), &size);
  std::array<uint8_t, 16> half{};
  std::copy_n(whole.begin(), half.size(), half.begin());
  return half;
}

}  // namespace comap
