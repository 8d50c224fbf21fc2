#include "protocol/storage/first_page.h"

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

// What is on the disk if a writer is killed before its log was first written into the file.
TEST(FirstPage, OfAFileWhoseTablesAreInItsLogIsWhole) {
  const TemporaryFolder folder;
  const std::string path = folder / "made.db", left = folder / "left.db";
  sqlite3* database = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &database), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(database, "PRAGMA journal_mode = WAL; CREATE TABLE a(b); INSERT INTO a VALUES(1)", nullptr,
                         nullptr, nullptr),
            SQLITE_OK);
  fs::copy_file(path, left);
  fs::copy_file(path + "-wal", left + "-wal");
  sqlite3_close(database);
  const std::vector<char> head = firstBytesOf(left, 60);
  ASSERT_EQ(head[47], 0) << "the case that is meant";
  EXPECT_EQ(headDamage(left), std::vector<std::string>());
  EXPECT_EQ(headDamage(path), std::vector<std::string>()) << "closed: its tables are in the file";

  for (const size_t at : {44u, 56u}) {
    std::vector<char> wrong = head;
    wrong[at] = 0x54;
    ASSERT_TRUE(overwriteStart(left, wrong));
    EXPECT_EQ(headDamage(left).size(), 1u) << at;
    wrong = firstBytesOf(path, 60);
    wrong[at + 3] = 0;
    ASSERT_TRUE(overwriteStart(path, wrong));
    EXPECT_EQ(headDamage(path).size(), 1u) << at << ": a file with tables says how they are written";
    ASSERT_TRUE(mendHead(path));
    EXPECT_EQ(headDamage(path), std::vector<std::string>()) << at;
  }
}

}  // namespace
}  // namespace comap
