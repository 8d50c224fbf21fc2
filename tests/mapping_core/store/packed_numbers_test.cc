#include "mapping_core/store/packed_numbers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

class PackedNumbersTest : public StoreTest {};

void expectSameBits(const Matrix6d& a, const Matrix6d& b) {
  EXPECT_EQ(std::memcmp(a.data(), b.data(), 36 * sizeof(double)), 0) << a << "\nand\n" << b;
}

TEST_F(PackedNumbersTest, TheyComeBackToTheBitInAsFewBytesAsTheyNeed) {
  const Matrix6d any = matrixOf(3), symmetric = any * any.transpose() + Matrix6d(any * any.transpose()).transpose();
  Matrix6d signed_zero = Matrix6d::Zero(), half_known = symmetric;
  signed_zero(2, 2) = -0.0;
  half_known(0, 1) = half_known(1, 0) = kNaN;
  Matrix6d last_bit = symmetric;
  last_bit(4, 1) = std::nextafter(last_bit(4, 1), 0.0);
  for (const auto& [information, bytes] : {std::pair<Matrix6d, size_t>{any, 348},
                                           {symmetric, 228},
                                           {Matrix6d::Zero(), 60},
                                           {signed_zero, 68},
                                           {Matrix6d::Identity(), 108},
                                           {half_known, 228},
                                           {last_bit, 348}}) {
    const auto packed = packNumbers(poseOf(7), information);
    EXPECT_EQ(packed.size(), bytes);
    std::string wrong;
    const auto unpacked = unpackNumbers(packed, wrong);
    ASSERT_TRUE(unpacked) << wrong;
    expectSameBits(unpacked->information, information);
    expectSame(unpacked->pose, poseOf(7));
  }
}

TEST_F(PackedNumbersTest, NoPoseIsNoPose) {
  std::string wrong;
  const Pose none(Eigen::Quaterniond(kNaN, kNaN, kNaN, kNaN), Eigen::Vector3d::Constant(kNaN));
  const auto unpacked = unpackNumbers(packNumbers(none, Matrix6d::Zero()), wrong);
  ASSERT_TRUE(unpacked) << wrong;
  EXPECT_TRUE(std::isnan(unpacked->pose.translation().x()));
}

TEST_F(PackedNumbersTest, WhatIsNoneIsRefusedWithTheReason) {
  auto bytes = packNumbers(poseOf(1), Matrix6d::Identity());
  std::string wrong;
  EXPECT_FALSE(unpackNumbers(std::vector<uint8_t>(), wrong));
  const size_t size = bytes.size();
  EXPECT_FALSE(unpackNumbers(std::span(bytes).first(size - 8), wrong));
  EXPECT_EQ(wrong, "its numbers, " + std::to_string(size - 8) +
                       " bytes, are not packed as a pose and an information matrix are");
  for (const int bit : {3, 29, 31}) {  // one number less, a bit without meaning, a matrix of which most is missing
    auto damaged = bytes;
    damaged[size_t(bit) / 8] = static_cast<uint8_t>(damaged[size_t(bit) / 8] ^ 1 << bit % 8);
    EXPECT_FALSE(unpackNumbers(damaged, wrong)) << bit;
  }
  std::fill(bytes.begin() + 4, bytes.end(), uint8_t{0});
  EXPECT_FALSE(unpackNumbers(bytes, wrong));
  EXPECT_NE(wrong.find("quaternion has length 0"), std::string::npos) << wrong;
}

TEST_F(PackedNumbersTest, SqlPacksTheSame) {
  auto database = Database::open(":memory:", SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  ASSERT_TRUE(database && addPacked(*database));
  std::string sql = "SELECT packed(0.0, 0.0, 0.0, 1.0, 1.5, -2.0, 3.25";
  Matrix6d information;
  for (int i = 0; i < 36; ++i) {
    information(i / 6, i % 6) = i == 8 ? kNaN : i;
    sql += i == 8 ? ", NULL" : ", " + std::to_string(i) + ".0";
  }
  sql += ")";
  auto query = database->query(sql);
  ASSERT_TRUE(query && *query->step());
  const auto bytes = query->bytes();
  EXPECT_EQ(std::vector<uint8_t>(bytes.begin(), bytes.end()),
            packNumbers(Pose(Eigen::Quaterniond::Identity(), {1.5, -2, 3.25}), information));
}

}  // namespace
}  // namespace comap
