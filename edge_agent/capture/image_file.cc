#include "edge_agent/capture/image_file.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include "edge_agent/capture/image_codec.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr size_t kMaxFile_bytes = size_t{256} << 20;

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

Result<std::vector<uint8_t>> readFile(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "rb"));
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be opened: " + std::strerror(errno)};
  std::vector<uint8_t> bytes;
  uint8_t chunk[1 << 16];
  while (true) {
    const size_t count = std::fread(chunk, 1, sizeof chunk, file.get());
    bytes.insert(bytes.end(), chunk, chunk + count);
    if (bytes.size() > kMaxFile_bytes) {
      return Error{ErrorCode::kBadData,
                   path + ": is larger than the " + std::to_string(kMaxFile_bytes >> 20) + " MiB a picture may have"};
    }
    if (count < sizeof chunk) break;
  }
  if (std::ferror(file.get())) {
    return Error{ErrorCode::kUnreachable, path + ": cannot be read: " + std::strerror(errno)};
  }
  if (bytes.empty()) return Error{ErrorCode::kBadData, path + ": is empty, expected a picture"};
  return bytes;
}

bool startsLikePng(const std::vector<uint8_t>& bytes) {
  return bytes.size() >= 4 && bytes[0] == 0x89 && bytes[1] == 'P' && bytes[2] == 'N' && bytes[3] == 'G';
}

bool startsLikeJpeg(const std::vector<uint8_t>& bytes) {
  return bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff;
}

}  // namespace

namespace codec_detail {

Result<void> checkSize(uint64_t width, uint64_t height, const std::string& name) {
  if (width >= 1 && height >= 1 && width <= kMaxImageEdge_px && height <= kMaxImageEdge_px) return {};
  return Error{ErrorCode::kBadData, name + ": says its size is " + std::to_string(width) + "x" +
                                        std::to_string(height) + ", expected 1 to " + std::to_string(kMaxImageEdge_px) +
                                        " pixels in each direction"};
}

}  // namespace codec_detail

Result<ColourImage> readColour(const std::string& path) {
  auto bytes = readFile(path);
  if (!bytes) return bytes.error();
  if (startsLikePng(*bytes)) return codec_detail::decodeColourPng(*bytes, path);
  if (startsLikeJpeg(*bytes)) return codec_detail::decodeJpeg(*bytes, path);
  return Error{ErrorCode::kBadData, path + ": is neither PNG nor JPEG by its first bytes"};
}

Result<DepthImage> readDepth16(const std::string& path) {
  auto bytes = readFile(path);
  if (!bytes) return bytes.error();
  if (!startsLikePng(*bytes)) return Error{ErrorCode::kBadData, path + ": is not PNG by its first bytes"};
  return codec_detail::decodeDepthPng(*bytes, path);
}

Result<void> writeColourJpeg(const std::string& path, const ColourImage& image, int quality) {
  auto bytes = codec_detail::encodeJpeg(image, quality, path);
  if (!bytes) return bytes.error();
  std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "wb"));
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be created: " + std::strerror(errno)};
  const bool written = std::fwrite(bytes->data(), 1, bytes->size(), file.get()) == bytes->size();
  if (std::fclose(file.release()) != 0 || !written) {
    return Error{ErrorCode::kUnreachable, path + ": cannot be written: " + std::strerror(errno)};
  }
  return {};
}

}  // namespace comap
