#include "mapping_core/store/store_lock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace comap {
namespace {

TEST(StoreLock, OneAtATimeAndFreeAgainAfterwards) {
  const std::string path = (std::filesystem::temp_directory_path() / std::to_string(getpid())).string();
  std::ofstream(path) << "store";
  {
    const auto first = StoreLock::take(path);
    ASSERT_TRUE(first);
    const auto second = StoreLock::take(path);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kUnreachable);
    EXPECT_NE(second.error().text.find(path), std::string::npos);
  }
  EXPECT_TRUE(StoreLock::take(path));
  std::filesystem::remove(path);
  EXPECT_FALSE(StoreLock::take(path));
}

}  // namespace
}  // namespace comap
