// What keyframes of real and simulated sensors take on the wire.
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

// As the PNG has it, times `factor`.
DepthImage readDepth(const fs::path& path, int factor) {
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (file == nullptr) return {};
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file);
  png_read_info(png, info);
  png_set_swap(png);
  DepthImage depth(static_cast<int>(png_get_image_width(png, info)), static_cast<int>(png_get_image_height(png, info)));
  for (int y = 0; y < depth.height(); ++y) png_read_row(png, reinterpret_cast<png_bytep>(depth.row(y)), nullptr);
  png_destroy_read_struct(&png, &info, nullptr);
  std::fclose(file);
  for (size_t i = 0; i < depth.size(); ++i) {
    depth.data()[i] = static_cast<uint16_t>(std::min(65535, factor * depth.data()[i]));
  }
  return depth;
}

// Of this thread, so that others on the machine count little.
double cpuTime_ms() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

class CodecSizes : public testing::TestWithParam<const char*> {};

TEST_P(CodecSizes, DepthIsSmallerThanPngAndFast) {
  const char* root = std::getenv("COMAP_DATA_DIR");
  if (root == nullptr) GTEST_SKIP() << "COMAP_DATA_DIR is not set";
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(root) / GetParam() / "depth")) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  double png_bytes = 0, bytes = 0;
  std::vector<double> encode_ms, decode_ms;
  for (size_t i = 0; i < files.size(); i += 20) {
    const DepthImage depth = readDepth(files[i], std::string(GetParam()) == "kitchen_dev" ? 5 : 1);
    ASSERT_FALSE(depth.empty()) << files[i];
    const double start = cpuTime_ms();
    const auto packed = encodeDepth(depth);
    const double middle = cpuTime_ms();
    ASSERT_TRUE(packed) << packed.error().text;
    const auto back = decodeDepth(*packed, depth.width(), depth.height());
    const double end = cpuTime_ms();
    ASSERT_TRUE(back && *back == depth);
    encode_ms.push_back(middle - start);
    decode_ms.push_back(end - middle);
    png_bytes += static_cast<double>(fs::file_size(files[i]));
    bytes += static_cast<double>(packed->size());
  }
  std::sort(encode_ms.begin(), encode_ms.end());
  std::sort(decode_ms.begin(), decode_ms.end());
  const auto count = static_cast<double>(encode_ms.size());
  std::printf("%s: %.0f images, PNG %.1f kB, here %.1f kB, encode %.1f ms, decode %.1f ms of CPU (medians)\n",
              GetParam(), count, png_bytes / count / 1e3, bytes / count / 1e3, encode_ms[encode_ms.size() / 2],
              decode_ms[decode_ms.size() / 2]);
  EXPECT_LT(bytes, 0.9 * png_bytes);
  // Ten times what it takes: a guard against another order of cost, not a benchmark.
  EXPECT_LT(encode_ms[encode_ms.size() / 2], 100);
}

std::vector<uint8_t> readBytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST_P(CodecSizes, AKeyframeIsAtMost150Kilobytes) {
  const char* root = std::getenv("COMAP_DATA_DIR");
  if (root == nullptr) GTEST_SKIP() << "COMAP_DATA_DIR is not set";
  const fs::path folder = fs::path(root) / GetParam();
  std::ifstream pairs(folder / "associations.txt");
  std::string stamps[2], files[2];
  double bytes = 0, colour_bytes = 0;
  int count = 0;
  for (int i = 0; pairs >> stamps[0] >> files[0] >> stamps[1] >> files[1]; ++i) {
    if (i % 20 != 0) continue;
    const int depth_at = files[0].starts_with("depth") ? 0 : 1;
    samples::Random random(1);
    Keyframe keyframe = samples::keyframe(random, 640, 480);
    keyframe.depth = readDepth(folder / files[depth_at], std::string(GetParam()) == "kitchen_dev" ? 5 : 1);
    auto colour = decodeColour(readBytes(folder / files[1 - depth_at]), 640, 480);
    ASSERT_TRUE(colour) << colour.error().text;
    keyframe.colour = std::move(*colour);
    const auto encoded = encodeKeyframe(keyframe);
    ASSERT_TRUE(encoded) << encoded.error().text;
    ASSERT_TRUE(decodeKeyframe(*encoded));
    bytes += static_cast<double>(encoded->size());
    colour_bytes += static_cast<double>(encodeColour(keyframe.colour)->size());
    ++count;
  }
  ASSERT_GE(count, 10);
  std::printf("%s: %d keyframes, mean %.1f kB, of it colour %.1f kB\n", GetParam(), count, bytes / count / 1e3,
              colour_bytes / count / 1e3);
  EXPECT_LT(bytes / count, 150e3);
}

INSTANTIATE_TEST_SUITE_P(Sequences, CodecSizes,
                         testing::Values("kitchen_dev", "house_dev/a", "house_dev/b", "house_dev/c", "icl_kt0_dev"));

}  // namespace
}  // namespace comap
