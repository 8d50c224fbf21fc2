#include "protocol/types/whole_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

TEST(WholeFile, ReplacesWhatWasThere) {
  const TemporaryFolder folder;
  const std::string path = folder.path("note");
  ASSERT_TRUE(writeWholeFile(path, "first and long"));
  ASSERT_TRUE(writeWholeFile(path, std::string_view("a\0b", 3)));
  EXPECT_EQ(contentOf(path), std::string("a\0b", 3));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);  // no temporary is left
}

TEST(WholeFile, SaysWhatItCouldNotWrite) {
  const auto written = writeWholeFile("/nonexistent/folder/note", "x");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(written.error().text.find("/nonexistent/folder/note"), std::string::npos);
}

TEST(WholeFile, LeavesDevicesAlone) {
  EXPECT_FALSE(writeWholeFile("/dev/null", "x"));
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
}

TEST(WholeFile, ChecksTheFolderBeforehand) {
  EXPECT_TRUE(checkWritable("", FileKind::kJson));
  EXPECT_TRUE(checkWritable("/tmp/x", FileKind::kAny));
  EXPECT_FALSE(checkWritable("/nonexistent/folder/x", FileKind::kAny));
}

TEST(WholeFile, TakesTheNameOfNoDatabase) {
  const TemporaryFolder folder;
  const std::string path = folder.path("map.comap"), content("SQLite format 3\0", 16);
  ASSERT_TRUE(writeWholeFile(path, content));
  for (const auto& refused : {writeWholeFile(path, "x"), checkWritable(path, FileKind::kAny)}) {
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  }
  EXPECT_EQ(contentOf(path), content);
}

TEST(WholeFile, TakesThePlaceOfItsKindOnly) {
  const TemporaryFolder folder;
  const auto holds = [&](const std::string& content) {
    const std::string path = folder.path("there");
    std::ofstream(path, std::ios::binary) << content;
    return path;
  };
  EXPECT_TRUE(checkReplaceable(folder.path("new"), FileKind::kJson));
  EXPECT_TRUE(checkReplaceable(holds(""), FileKind::kPng));
  EXPECT_TRUE(checkReplaceable(holds("[{}]"), FileKind::kJson));
  EXPECT_TRUE(checkReplaceable(holds("{"), FileKind::kJson));
  EXPECT_TRUE(checkReplaceable(holds("\x89PNG\r\n and more"), FileKind::kPng));
  EXPECT_TRUE(checkReplaceable(holds("robot: a\n"), FileKind::kAny));
  for (const FileKind kind : {FileKind::kJson, FileKind::kPng}) {
    const auto refused = checkReplaceable(holds("robot: a\n"), kind);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kWrongUse);
  }
  EXPECT_FALSE(checkReplaceable(holds("{}"), FileKind::kPng));
  EXPECT_FALSE(writeWholeFile(holds("525 525 319.5 239.5 640 480 1000\n"), "{}", FileKind::kJson));
}

TEST(WholeFile, AFullDiskLeavesNothing) {
  if (access("/dev/full", W_OK) != 0) GTEST_SKIP() << "no /dev/full on this system";
  const TemporaryFolder folder;
  const std::string path = folder.path("note");
  std::filesystem::create_symlink("/dev/full", path + ".part");
  EXPECT_FALSE(writeWholeFile(path, std::string(100000, 'x')));
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_FALSE(std::filesystem::is_symlink(path + ".part"));
}

TEST(WholeFile, OnlyRegularFilesAreRead) {
  const TemporaryFolder folder;
  const std::string file = folder.write("file", "x"), pipe = folder / "pipe", link = folder / "link";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::filesystem::create_symlink(pipe, link);
  EXPECT_TRUE(checkRegular(file));
  EXPECT_TRUE(checkRegular(folder / "nothing")) << "its reader says that best";
  for (const auto& [path, what] : {std::pair(pipe, "a named pipe"),
                                   {link, "a named pipe"},
                                   {folder.path(), "a folder"},
                                   {std::string("/dev/zero"), "a device"}}) {
    const auto checked = checkRegular(path);
    ASSERT_FALSE(checked) << path;
    EXPECT_EQ(checked.error().code, ErrorCode::kUnreachable);
    EXPECT_EQ(checked.error().text, path + ": is " + what + ", expected a regular file");
  }
}

}  // namespace
}  // namespace comap
