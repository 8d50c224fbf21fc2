#include "protocol/types/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace comap {
namespace {

Result<std::unique_ptr<int>> half(int number) {
  if (number % 2 != 0) return Error{ErrorCode::kBadData, std::to_string(number) + " is odd"};
  return std::make_unique<int>(number / 2);
}

Result<void> refuse(bool really) {
  if (really) return Error{ErrorCode::kProblem, "refused"};
  return {};
}

TEST(Result, carriesAValueThatCanOnlyMove) {
  auto result = half(8);
  ASSERT_TRUE(result);
  EXPECT_EQ(**result, 4);
  EXPECT_EQ(*result->get(), 4);
  const std::unique_ptr<int> taken = std::move(result).value();
  EXPECT_EQ(*taken, 4);
}

TEST(Result, carriesTheReason) {
  const auto result = half(7);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kBadData);
  EXPECT_EQ(result.error().text, "7 is odd");
}

TEST(Result, ofNothingIsDoneOrRefused) {
  EXPECT_TRUE(refuse(false));
  ASSERT_FALSE(refuse(true));
  EXPECT_EQ(refuse(true).error().text, "refused");
}

TEST(Result, codesBecomeExitCodes) {
  EXPECT_EQ(exitCodeOf(ErrorCode::kProblem), 1);
  EXPECT_EQ(exitCodeOf(ErrorCode::kWrongUse), 2);
  for (const ErrorCode code :
       {ErrorCode::kUnreachable, ErrorCode::kBadData, ErrorCode::kNoDevice, ErrorCode::kOutOfMemory})
    EXPECT_EQ(exitCodeOf(code), 3);
}

}  // namespace
}  // namespace comap
