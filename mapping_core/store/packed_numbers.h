// The numbers of an edge or a verdict, a relative pose and how well it is known, as bytes on disk.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/storage/database.h"

namespace comap {

/// To the bit, little endian: 4 bytes that say which numbers follow, bit by bit from the lowest: qx, qy, qz, qw, tx,
/// ty, tz, and the information's upper triangle row by row; a number that is zero does not. Then those, 8 bytes each.
/// With the highest bit, all 36 numbers of an information that is not symmetric follow, those 21 bits being set.
std::vector<uint8_t> packNumbers(const Pose& pose, const Matrix6d& information);

struct PackedNumbers {
  Pose pose;
  Matrix6d information = Matrix6d::Zero();
};
/// Nothing, and why, if they are not packed so, or no pose.
std::optional<PackedNumbers> unpackNumbers(std::span<const uint8_t> bytes, std::string& wrong);

/// From now on statements know packed(...), of the 7 numbers of a pose and the 36 of an information matrix, a NULL
/// being NaN: what packNumbers() makes of them.
Result<void> addPacked(Database& database);

}  // namespace comap
