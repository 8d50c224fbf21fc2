#include "edge_agent/capture/source_uri.h"

#include <gtest/gtest.h>

#include "edge_agent/capture/image_file.h"
#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

TEST(SourceUri, ReadsRanges) {
  const auto place = [](const char* text) { return parseTumPlace(text).value(); };
  EXPECT_EQ(place("/data/a").directory, "/data/a");
  EXPECT_EQ(place("/data/a").range.last, TumRange::kToEnd);
  EXPECT_EQ(place("/data/a@10:20").directory, "/data/a");
  EXPECT_EQ(place("/data/a@10:20").range.first, 10u);
  EXPECT_EQ(place("/data/a@10:20").range.last, 20u);
  EXPECT_EQ(place("a@:20").range.first, 0u);
  EXPECT_EQ(place("a@7:").range.last, TumRange::kToEnd);
  EXPECT_EQ(place("/home/me@work/a").directory, "/home/me@work/a");
  EXPECT_EQ(place("/home/me@work/a@1:2").directory, "/home/me@work/a");
  for (const char* text :
       {"a@", "a@5", "a@x:3", "a@3:y", "a@-1:3", "a@1:2:3", "a@99999999999999999999999:", "", "@1:2"}) {
    auto result = parseTumPlace(text);
    ASSERT_FALSE(result) << text;
    EXPECT_EQ(result.error().code, ErrorCode::kWrongUse);
  }
}

TEST(SourceUri, AFolderWithAnAtInItsNameIsItself) {
  TemporaryFolder folder;
  std::filesystem::create_directory(folder / "odd@name");
  EXPECT_EQ(parseTumPlace(folder / "odd@name").value().directory, folder / "odd@name");
}

TEST(SourceUri, OpensWithAndWithoutScheme) {
  TemporaryFolder folder;
  folder.write("calibration.txt", "5 5 0 0 2 2 5000\n");
  folder.write("associations.txt", "1 c.png 1 d.png\n2 c.png 2 d.png\n");
  ASSERT_TRUE(writeColourPng(folder / "c.png", ColourImage(2, 2)));
  ASSERT_TRUE(writeDepth16Png(folder / "d.png", DepthImage(2, 2)));
  for (const std::string& uri : {"tum:" + folder.path(), folder.path(), "tum:" + folder.path() + "@0:2"}) {
    auto source = openSource(uri);
    ASSERT_TRUE(source) << source.error().text;
    EXPECT_EQ((*source)->size(), 2u);
  }
  auto part = openSource(folder.path() + "@1:2");
  ASSERT_TRUE(part);
  EXPECT_EQ((*part)->size(), 1u);
  EXPECT_NE((*part)->description().find("1:2 of 2"), std::string::npos) << (*part)->description();
}

TEST(SourceUri, UnknownSchemeListsTheKnown) {
  auto source = openSource("webcam:0");
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().code, ErrorCode::kWrongUse);
  EXPECT_NE(source.error().text.find("'webcam'"), std::string::npos);
  EXPECT_NE(source.error().text.find("tum:DIR"), std::string::npos);
}

}  // namespace
}  // namespace comap
