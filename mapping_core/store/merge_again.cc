#include "mapping_core/store/merge_again.h"

#include <charconv>

#include "mapping_core/store/map_store_state.h"

namespace comap {
namespace {

constexpr std::string_view kPrefix = "merge_given_again_";

template <class Number>
std::optional<Number> numberOf(std::string_view text) {
  Number number = 0;
  const char* end = text.data() + text.size();
  const auto [at, code] = std::from_chars(text.data(), end, number);
  return code == std::errc() && at == end ? std::optional(number) : std::nullopt;
}

}  // namespace

std::string againKey(uint32_t merge) { return std::string(kPrefix) + std::to_string(merge); }

std::optional<uint32_t> mergeOfAgainKey(const std::string& key) {
  return key.starts_with(kPrefix) ? numberOf<uint32_t>(std::string_view(key).substr(kPrefix.size())) : std::nullopt;
}

Result<void> dropAgainOfNone(Database& database) {
  return database.execute(
      "DELETE FROM meta WHERE key GLOB 'merge_given_again_*' AND NOT EXISTS "
      "(SELECT 1 FROM merges WHERE key = 'merge_given_again_' || number)");
}

Result<std::optional<size_t>> MapStore::givenAgain(uint32_t merge) const {
  const auto text = meta(againKey(merge));
  if (!text) return text.error();
  if (text->empty()) return std::optional<size_t>();
  const auto count = numberOf<size_t>(*text);
  if (!count)
    return Error{ErrorCode::kBadData, state_->database.path() + ": meta '" + againKey(merge) + "' is '" + *text +
                                          "', expected a number of keyframes"};
  return count;
}

Result<void> MapStore::setGivenAgain(uint32_t merge, size_t keyframes) {
  return setMeta(againKey(merge), std::to_string(keyframes));
}

}  // namespace comap
