#include "mapping_core/store/stray_messages.h"

#include <cstddef>
#include <utility>

namespace comap {
namespace {

constexpr size_t kEncoded = 1;  // column; the one before it is the row's number, and stands elsewhere

// Whose table a leaf is of is not told on it: number, columns and size have to be those of a message.
bool isLike(const LeafRow& row, const std::map<int64_t, int64_t>& sizes) {
  using Kind = LeafRow::Column::Kind;
  if (row.columns.size() != 2 || row.columns[0].kind != Kind::kOther || row.columns[kEncoded].kind != Kind::kBlob)
    return false;
  const auto size = sizes.find(row.number);
  return size != sizes.end() && std::cmp_equal(row.columns[kEncoded].size, size->second);
}

}  // namespace

std::map<int64_t, LeafRow> findStrays(
    const std::string& path, const std::map<int64_t, int64_t>& sizes,
    const std::function<bool(int64_t number, std::span<const uint8_t> message)>& isWhole) {
  std::map<int64_t, LeafRow> strays;
  auto leaves = LeafRows::open(path);
  if (!leaves) return strays;
  leaves->each([&](const LeafRow& row) {
    if (!isLike(row, sizes) || strays.contains(row.number)) return;
    if (const auto message = leaves->blob(row, kEncoded); message && isWhole(row.number, *message))
      strays.emplace(row.number, row);
  });
  return strays;
}

Result<void> copyStrays(Database& to, const StoreSurvey& survey) {
  if (survey.strays.empty()) return {};
  auto leaves = LeafRows::open(survey.path);
  if (!leaves) return leaves.error();
  for (const auto& [number, row] : survey.strays) {
    const auto message = leaves->blob(row, kEncoded);
    if (!message)
      return Error{ErrorCode::kUnreachable, survey.path + ": the message of keyframe " + std::to_string(number) +
                                                " could be read before, and cannot any more"};
    auto insert = to.query("INSERT INTO main.keyframe_messages (keyframe, encoded) VALUES (?, ?)");
    if (!insert) return insert.error();
    if (auto ran = insert->bind(number).bind(std::span<const uint8_t>(*message)).run(); !ran) return ran;
  }
  return {};
}

}  // namespace comap
