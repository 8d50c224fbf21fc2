#include "mapping_core/store/store_lock.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/mapping_core/store/store_fixture.h"

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

class WritersTest : public StoreTest {};

TEST_F(WritersTest, TheSecondIsRefusedAndReadersAreNot) {
  auto first = create();
  ASSERT_TRUE(first) << first.error().text;
  ASSERT_TRUE(first->addKeyframe(idOf(0), 1, bytesOf(1, 300)));
  for (const auto mode : {MapStore::Mode::kCreateOrOpen, MapStore::Mode::kOpen}) {
    const auto second = MapStore::open(path_, mode);
    ASSERT_FALSE(second);
    EXPECT_EQ(second.error().code, ErrorCode::kUnreachable);
    EXPECT_NE(second.error().text.find("another program has it"), std::string::npos) << second.error().text;
  }
  EXPECT_TRUE(read());
  EXPECT_TRUE(first->addKeyframe(idOf(1), 2, bytesOf(2, 300)));
  first = Error{ErrorCode::kProblem, "closed"};
  auto later = create();
  ASSERT_TRUE(later) << later.error().text;
  EXPECT_EQ(later->keyframes()->size(), 2u);
}

// Whoever has the lock has not made the tables yet: the other must not make them either, nor bring old ones forward.
TEST_F(WritersTest, OneThatIsRefusedHasChangedNothing) {
  const auto lock = StoreLock::take(path_, true);
  ASSERT_TRUE(lock) << lock.error().text;
  EXPECT_FALSE(create());
  EXPECT_EQ(std::filesystem::file_size(path_), 0u);
  EXPECT_FALSE(std::filesystem::exists(path_.string() + "-wal"));
}

}  // namespace
}  // namespace comap
