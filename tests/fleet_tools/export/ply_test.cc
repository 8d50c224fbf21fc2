#include "fleet_tools/export/ply.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>

#include "tests/files/temporary_folder.h"

namespace comap {
namespace {

TEST(Ply, MapIsReadBack) {
  TemporaryFolder folder;
  std::vector<MapPoint> points(3);
  for (size_t i = 0; i < 3; ++i) {
    points[i].position = {1.5f * static_cast<float>(i), -2, 0.25f};
    points[i].normal = {0, i == 1 ? -1.0f : 0.0f, i == 1 ? 0.0f : 1.0f};
    points[i].colour = {1, 2, 3};
  }
  ASSERT_TRUE(writePly(folder / "m.ply", points));
  auto read = readPly(folder / "m.ply");
  ASSERT_TRUE(read) << read.error().text;
  ASSERT_EQ(read->positions.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(read->positions[i], points[i].position);
    EXPECT_EQ(read->normals[i], points[i].normal);
  }
  const std::string bytes = folder.read("m.ply");
  EXPECT_EQ(bytes.size() - (bytes.find("end_header\n") + 11), 3u * 35);
  EXPECT_NE(bytes.find("property uchar red\n"), std::string::npos);
  EXPECT_NE(bytes.find("property float radius\nproperty float confidence\n"), std::string::npos);
}

TEST(Ply, EmptyMapIsAFile) {
  TemporaryFolder folder;
  ASSERT_TRUE(writePly(folder / "m.ply", {}));
  auto read = readPly(folder / "m.ply");
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_TRUE(read->positions.empty());
  EXPECT_FALSE(writePly(folder / "no/such/m.ply", {}));
}

TEST(Ply, AsciiWithOtherPropertiesAndFaces) {
  TemporaryFolder folder;
  folder.write(
      "a.ply",
      "ply\r\nformat ascii 1.0\r\ncomment hello\r\nelement vertex 2\r\nproperty uchar red\r\nproperty double x\r\n"
      "property double y\r\nproperty double z\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\n"
      "end_header\r\n255 1 2 3\r\n0 -1e-1 0 7.5\r\n3 0 1 0\r\n");
  auto read = readPly(folder / "a.ply");
  ASSERT_TRUE(read) << read.error().text;
  ASSERT_EQ(read->positions.size(), 2u);
  EXPECT_EQ(read->positions[1], Eigen::Vector3f(-0.1f, 0, 7.5f));
  EXPECT_TRUE(read->normals.empty());
}

TEST(Ply, Int8NormalsBecomeUnit) {
  TemporaryFolder folder;
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
      "property char nx\nproperty char ny\nproperty char nz\nend_header\n";
  const float position[3] = {1, 2, 3};
  bytes.append(reinterpret_cast<const char*>(position), sizeof position);
  bytes += std::string("\x00\x81\x00", 3);  // 0, -127, 0
  folder.write("n.ply", bytes);
  auto read = readPly(folder / "n.ply");
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(read->normals[0], Eigen::Vector3f(0, -1, 0));
}

TEST(Ply, HostileHeadersAndBodiesAreRefused) {
  TemporaryFolder folder;
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const std::string start = "ply\nformat binary_little_endian 1.0\n";
  const std::pair<std::string, const char*> cases[] = {
      {"", "ends too early"},
      {"plyx\n", "does not begin"},
      {"ply\nformat binary_big_endian 1.0\n", "binary_big_endian"},
      {start + "element vertex 1\n" + xyz, "ends too early"},
      {start + "element vertex 99999999999999\n" + xyz + "end_header\nabc", "more than the"},
      {start + "element vertex 18446744073709551616\n" + xyz + "end_header\n", "number of vertices"},
      {start + "element vertex -1\n" + xyz + "end_header\n", "number of vertices"},
      {start + "element vertex 1\n" + xyz + "end_header\nshort", "ends after 0 of 1"},
      {start + "element vertex 12\n" + xyz + "end_header\n" + std::string(140, '\1'), "ends after 11 of 12"},
      {start + "element vertex 1\nproperty float x\nproperty float y\nend_header\n", "no x, y and z"},
      {start + "element vertex 1\n" + xyz + "property float x\nend_header\n", "occurs twice"},
      {start + "element vertex 1\n" + xyz + "property float nx\nend_header\n", "normals are not complete"},
      {start + "element vertex 1\nproperty int x\nend_header\n", "expected float or double"},
      {start + "element vertex 1\nproperty list uchar float x\nend_header\n", "list"},
      {start + "element vertex 1\nproperty strange x\nend_header\n", "strange"},
      {start + "element face 1\nend_header\n", "expected vertex"},
      {"ply\nelement vertex 0\n" + xyz + "end_header\n", "names no format"},
      {start + "element vertex 1\n" + xyz + "end_header\n" + std::string("\0\0\xc0\x7f\0\0\0\0\0\0\0\0", 12),
       "not finite"},
      {"ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "end_header\n1 2 3\n4 5 six\n", "'six'"},
      {"ply\nformat ascii 1.0\nelement vertex 2\n" + xyz + "end_header\n1 2 3\n4 5 \n", "ends after 1 of 2"},
      {"ply\n" + std::string(10000, 'x') + "\n", "ends too early"}};
  for (const auto& [bytes, word] : cases) {
    folder.write("h.ply", bytes);
    auto read = readPly(folder / "h.ply");
    ASSERT_FALSE(read) << word;
    EXPECT_EQ(read.error().code, ErrorCode::kBadData);
    EXPECT_NE(read.error().text.find(word), std::string::npos) << read.error().text;
  }
  EXPECT_EQ(readPly(folder / "none.ply").error().code, ErrorCode::kUnreachable);
}

TEST(Ply, ReadsTheHouseSurface) {
  const char* root = std::getenv("COMAP_DATA_DIR");
  if (root == nullptr) GTEST_SKIP() << "COMAP_DATA_DIR is not set: the recorded surface is not here";
  auto read = readPly(std::string(root) + "/house_dev/surface.ply");
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(read->positions.size(), 661912u);
  ASSERT_EQ(read->normals.size(), read->positions.size());
  for (size_t i = 0; i < read->normals.size(); i += 1000) EXPECT_NEAR(read->normals[i].norm(), 1, 1e-5);
}

}  // namespace
}  // namespace comap
