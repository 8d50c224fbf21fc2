#include "protocol/codec/fern_code_codec.h"

#include <string>

#include "protocol/codec/limits.h"

namespace comap::codec {

Result<void> write(const FernCode& code, v1::FernCode* to, const std::string& field) {
  const size_t count = code.codes.size();
  if (count > kMaxFerns) {
    return Error{ErrorCode::kWrongUse,
                 field + " has " + std::to_string(count) + " ferns, expected at most " + std::to_string(kMaxFerns)};
  }
  std::string codes((count + 1) / 2, '\0'), valid((count + 7) / 8, '\0');
  for (size_t i = 0; i < count; ++i) {
    const uint8_t value = code.codes[i];
    if (value == FernCode::kBad) continue;
    if (value > 15) {
      return Error{ErrorCode::kWrongUse, field + ".codes[" + std::to_string(i) + "] is " + std::to_string(value) +
                                             ", expected 0 to 15 or 255"};
    }
    codes[i / 2] = static_cast<char>(codes[i / 2] | value << (4 * (i % 2)));
    valid[i / 8] = static_cast<char>(valid[i / 8] | 1 << (i % 8));
  }
  to->set_book_hash(code.book_hash);
  to->set_count(static_cast<uint32_t>(count));
  to->set_codes(std::move(codes));
  to->set_valid(std::move(valid));
  return {};
}

Result<FernCode> readFernCode(const v1::FernCode& from, const std::string& field) {
  const size_t count = from.count();
  if (count > kMaxFerns) {
    return Error{ErrorCode::kBadData,
                 field + ".count is " + std::to_string(count) + ", expected at most " + std::to_string(kMaxFerns)};
  }
  if (from.codes().size() != (count + 1) / 2 || from.valid().size() != (count + 7) / 8) {
    return Error{ErrorCode::kBadData, field + " has " + std::to_string(from.codes().size()) + " bytes of codes and " +
                                          std::to_string(from.valid().size()) + " of mask for " +
                                          std::to_string(count) + " ferns"};
  }
  FernCode code;
  code.book_hash = from.book_hash();
  code.codes.resize(count);
  const std::string &codes = from.codes(), &valid = from.valid();
  for (size_t i = 0; i < count; ++i) {  // without a jump: which ferns are valid, no processor can guess
    const auto told = static_cast<uint8_t>((codes[i / 2] >> (4 * (i % 2))) & 15);
    code.codes[i] = ((valid[i / 8] >> (i % 8)) & 1) != 0 ? told : FernCode::kBad;
  }
  return code;
}

}  // namespace comap::codec
