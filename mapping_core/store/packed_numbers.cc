#include "mapping_core/store/packed_numbers.h"

#include <array>
#include <bit>
#include <cstring>
#include <limits>

namespace comap {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers are written as they lie in memory");

constexpr size_t kPose = 7, kTriangle = 21, kMatrix = 36;
using Numbers = std::array<double, kPose + kMatrix>;
using Mask = uint32_t;
constexpr Mask kWholeMatrix = Mask{1} << 31;

double& at(Numbers& numbers, size_t row, size_t column) { return numbers[kPose + 6 * row + column]; }

// By its bits: a zero has a sign.
uint64_t bitsOf(double number) { return std::bit_cast<uint64_t>(number); }

bool isSymmetric(Numbers& numbers) {
  bool same = true;
  for (size_t row = 0; row < 6; ++row)
    for (size_t column = 0; column < row; ++column)
      same = same && bitsOf(at(numbers, row, column)) == bitsOf(at(numbers, column, row));
  return same;
}

// The upper triangle behind the pose.
void fold(Numbers& numbers) {
  size_t next = kPose;
  for (size_t row = 0; row < 6; ++row)
    for (size_t column = row; column < 6; ++column) numbers[next++] = at(numbers, row, column);
}

std::vector<uint8_t> bytesOf(Numbers numbers) {
  Mask mask = 0;
  size_t kept = 0, all = kPose + kTriangle;
  if (isSymmetric(numbers)) {
    fold(numbers);
  } else {
    mask |= kWholeMatrix;
    all = numbers.size();
  }
  for (size_t i = 0; i < all; ++i) {
    const bool keep = i >= kPose + kTriangle || (mask & kWholeMatrix && i >= kPose) || bitsOf(numbers[i]) != 0;
    if (i < kPose + kTriangle && keep) mask |= Mask{1} << i;
    if (keep) numbers[kept++] = numbers[i];
  }
  std::vector<uint8_t> bytes(sizeof mask + kept * sizeof(double));
  std::memcpy(bytes.data(), &mask, sizeof mask);
  std::memcpy(bytes.data() + sizeof mask, numbers.data(), kept * sizeof(double));
  return bytes;
}

// What bytesOf() was given; nothing if it never makes such bytes.
std::optional<Numbers> numbersOf(std::span<const uint8_t> bytes) {
  Mask mask = 0;
  if (bytes.size() < sizeof mask) return std::nullopt;
  std::memcpy(&mask, bytes.data(), sizeof mask);
  const bool whole = (mask & kWholeMatrix) != 0;
  const Mask told = mask & ((Mask{1} << (kPose + kTriangle)) - 1);
  const size_t kept = static_cast<size_t>(std::popcount(told)) + (whole ? kMatrix - kTriangle : 0);
  if ((mask & ~kWholeMatrix) != told || bytes.size() != sizeof mask + kept * sizeof(double)) return std::nullopt;
  const uint8_t* next = bytes.data() + sizeof mask;
  const auto take = [&](bool is_there) {
    double number = 0;
    if (is_there) std::memcpy(&number, next, sizeof number);
    next += is_there ? sizeof number : 0;
    return number;
  };
  Numbers numbers;
  for (size_t i = 0; i < kPose; ++i) numbers[i] = take(told >> i & 1);
  if (whole) {
    if (told >> kPose != (Mask{1} << kTriangle) - 1) return std::nullopt;
    for (size_t i = 0; i < kMatrix; ++i) numbers[kPose + i] = take(true);
    return numbers;
  }
  size_t bit = kPose;
  for (size_t row = 0; row < 6; ++row)
    for (size_t column = row; column < 6; ++column)
      at(numbers, row, column) = at(numbers, column, row) = take(told >> bit++ & 1);
  return numbers;
}

void packed(sqlite3_context* context, int count, sqlite3_value** values) {
  Numbers numbers;
  if (static_cast<size_t>(count) != numbers.size())
    return sqlite3_result_error(context, "packed() takes 43 numbers", -1);
  for (size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = sqlite3_value_type(values[i]) == SQLITE_NULL ? std::numeric_limits<double>::quiet_NaN()
                                                              : sqlite3_value_double(values[i]);
  const std::vector<uint8_t> bytes = bytesOf(numbers);
  sqlite3_result_blob64(context, bytes.data(), bytes.size(), SQLITE_TRANSIENT);
}

}  // namespace

std::vector<uint8_t> packNumbers(const Pose& pose, const Matrix6d& information) {
  const Eigen::Quaterniond& q = pose.rotation();
  const Eigen::Vector3d& t = pose.translation();
  Numbers numbers{q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column) at(numbers, size_t(row), size_t(column)) = information(row, column);
  return bytesOf(numbers);
}

std::optional<PackedNumbers> unpackNumbers(std::span<const uint8_t> bytes, std::string& wrong) {
  auto numbers = numbersOf(bytes);
  if (!numbers) {
    wrong = "its numbers, " + std::to_string(bytes.size()) +
            " bytes, are not packed as a pose and an information matrix are";
    return std::nullopt;
  }
  std::string no_pose;
  PackedNumbers result;
  result.pose = poseOf(std::span(*numbers).first<kPose>(), no_pose);
  if (!no_pose.empty()) {
    wrong = no_pose;
    return std::nullopt;
  }
  for (int row = 0; row < 6; ++row)
    for (int column = 0; column < 6; ++column)
      result.information(row, column) = at(*numbers, size_t(row), size_t(column));
  return result;
}

Result<void> addPacked(Database& database) { return database.addFunction("packed", packed); }

}  // namespace comap
