#include "edge_agent/capture/klg_source.h"

#include <spdlog/fmt/fmt.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "edge_agent/capture/frame_maker.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr size_t kHeadBytes = 16;
constexpr int64_t kFramePeriod_ns = 33'333'333;

struct Entry {
  int64_t stamp_ns;
  uint64_t offset;  // of its depth
  uint32_t depth_bytes, colour_bytes;
};

Error cannotRead(const std::string& path) {
  const int why = errno;
  std::error_code ignored;
  const bool other = std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored);
  return {ErrorCode::kUnreachable,
          path + (other ? ": is no file" : std::string(": cannot be read: ") + std::strerror(why))};
}

template <class T>
T valueAt(const char* bytes) {  // as every machine that wrote such logs: low byte first
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return value;
}

struct Index {
  std::vector<Entry> entries;
  size_t promised = 0;       // frames that the log says it has
  bool stamps_made = false;  // its own do not grow

  /// What whoever opened the log should know; empty if all is well.
  std::string oddity() const {
    std::string text;
    if (entries.size() < promised) text += fmt::format(", cut off: it says it has {}", promised);
    if (stamps_made) text += ", its stamps do not grow: 30 frames a second instead";
    return text;
  }
};

// Where each frame lies. A log that was cut off ends with its last whole frame.
Result<Index> readIndex(std::ifstream& file, const std::string& path, const CameraModel& camera) {
  std::error_code problem;
  const uint64_t size = std::filesystem::file_size(path, problem);
  char head[kHeadBytes];
  if (problem || !file.read(head, 4)) return Error{ErrorCode::kBadData, path + ": is too short for a .klg"};
  const auto count = valueAt<int32_t>(head);
  if (count < 1 || static_cast<uint64_t>(count) > size / kHeadBytes)
    return Error{ErrorCode::kBadData, fmt::format("{}: says it has {} frames, in {} bytes", path, count, size)};
  const uint64_t pixels = static_cast<uint64_t>(camera.width) * static_cast<uint64_t>(camera.height);
  std::vector<Entry> entries;
  uint64_t at = 4;
  while (entries.size() < static_cast<size_t>(count) && at + kHeadBytes <= size) {
    file.seekg(static_cast<std::streamoff>(at));
    if (!file.read(head, kHeadBytes)) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
    const auto depth_bytes = valueAt<int32_t>(head + 8), colour_bytes = valueAt<int32_t>(head + 12);
    // zlib adds at most a little to what it cannot compress; JPEG may be large, but not larger than the picture twice.
    if (depth_bytes < 1 || colour_bytes < 0 || static_cast<uint64_t>(depth_bytes) > 2 * pixels + pixels / 100 + 1024 ||
        static_cast<uint64_t>(colour_bytes) > 6 * pixels + 65536)
      return Error{ErrorCode::kBadData,
                   fmt::format("{}: frame {} says it has {} bytes of depth and {} of colour, which does not fit "
                               "pictures of {}x{}",
                               path, entries.size(), depth_bytes, colour_bytes, camera.width, camera.height)};
    const uint64_t next = at + kHeadBytes + static_cast<uint64_t>(depth_bytes) + static_cast<uint64_t>(colour_bytes);
    if (next > size) break;
    entries.push_back({valueAt<int64_t>(head), at + kHeadBytes, static_cast<uint32_t>(depth_bytes),
                       static_cast<uint32_t>(colour_bytes)});
    at = next;
  }
  if (entries.empty()) return Error{ErrorCode::kBadData, path + ": ends before its first frame"};
  bool grow = true;
  for (size_t i = 0; i < entries.size(); ++i)
    grow = grow && entries[i].stamp_ns >= 0 && entries[i].stamp_ns < 9'000'000'000'000'000 &&
           (i == 0 || entries[i].stamp_ns > entries[i - 1].stamp_ns);
  for (size_t i = 0; i < entries.size(); ++i)
    entries[i].stamp_ns = grow ? entries[i].stamp_ns * 1000 : static_cast<int64_t>(i) * kFramePeriod_ns;
  return Index{std::move(entries), static_cast<size_t>(count), !grow};
}

class KlgSource final : public FrameSource {
 public:
  KlgSource(std::string path, std::ifstream file, std::vector<Entry> entries, TumRange range, size_t total,
            std::string oddity, FrameMaker maker, const CameraModel& pictures)
      : path_(std::move(path)),
        file_(std::move(file)),
        entries_(std::move(entries)),
        range_(range),
        total_(total),
        oddity_(std::move(oddity)),
        maker_(std::move(maker)),
        pictures_(pictures) {}

  Result<std::optional<Frame>> next() override {
    if (position_ == entries_.size()) return std::optional<Frame>();
    const size_t index = range_.first + position_;
    const Entry& entry = entries_[position_++];
    PicturePair pair;
    pair.colour.stamp_ns = pair.depth.stamp_ns = entry.stamp_ns;
    auto made = readDepth(entry, pair.depth);
    if (made) made = readColour(entry, pair.colour);
    if (!made) return wrong(index, made.error());
    auto frame = maker_.make(pair);
    if (!frame) return wrong(index, frame.error());
    return std::optional<Frame>(std::move(*frame));
  }

  size_t size() const override { return entries_.size(); }
  std::string description() const override {
    return fmt::format("log {}, frames {}:{} of {}, {}x{}{}", path_, range_.first, range_.last, total_,
                       maker_.camera().width, maker_.camera().height, oddity_);
  }

 private:
  Error wrong(size_t index, const Error& error) const {
    return {error.code, fmt::format("{}: frame {}: {}", path_, index, error.text)};
  }

  Result<std::vector<uint8_t>> read(uint64_t offset, uint32_t count) {
    std::vector<uint8_t> bytes(count);
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(offset));
    if (!file_.read(reinterpret_cast<char*>(bytes.data()), count))
      return Error{ErrorCode::kUnreachable, "cannot be read"};
    return bytes;
  }

  Result<void> readDepth(const Entry& entry, Picture& depth) {
    auto bytes = read(entry.offset, entry.depth_bytes);
    if (!bytes) return bytes.error();
    const size_t wanted = 2 * static_cast<size_t>(pictures_.width) * static_cast<size_t>(pictures_.height);
    depth.format = PixelFormat::kZ16;
    depth.width = pictures_.width;
    depth.height = pictures_.height;
    depth.stride_bytes = 2 * pictures_.width;
    if (bytes->size() == wanted) {
      depth.bytes = std::move(*bytes);
      return {};
    }
    depth.bytes.resize(wanted);
    uLongf found = wanted;
    if (uncompress(depth.bytes.data(), &found, bytes->data(), bytes->size()) != Z_OK || found != wanted)
      return Error{ErrorCode::kBadData, fmt::format("its depth does not unpack to the {} bytes of {}x{} pixels", wanted,
                                                    pictures_.width, pictures_.height)};
    return {};
  }

  Result<void> readColour(const Entry& entry, Picture& colour) {
    auto bytes = read(entry.offset + entry.depth_bytes, entry.colour_bytes);
    if (!bytes) return bytes.error();
    colour.width = pictures_.width;
    colour.height = pictures_.height;
    colour.stride_bytes = 3 * pictures_.width;
    const size_t plain = 3 * static_cast<size_t>(pictures_.width) * static_cast<size_t>(pictures_.height);
    colour.format = bytes->size() == plain ? PixelFormat::kRgb3 : PixelFormat::kMjpeg;
    colour.bytes = std::move(*bytes);
    return {};
  }

  std::string path_;
  std::ifstream file_;
  std::vector<Entry> entries_;
  TumRange range_;
  size_t total_;
  std::string oddity_;
  FrameMaker maker_;
  CameraModel pictures_;
  size_t position_ = 0;
};

}  // namespace

Result<std::unique_ptr<FrameSource>> openKlg(const std::string& path, TumRange range, const CameraConfig& camera) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path, std::ios::binary);
  if (!file) return cannotRead(path);
  CameraRig rig = camera.rig;
  const CameraModel& pictures = rig.colour.pinhole;
  if (pictures.fx <= 0 || pictures.fy <= 0)
    return Error{ErrorCode::kWrongUse,
                 path + ": a log does not tell its focal lengths: give camera.profile or camera.colour.fx ..."};
  const bool registered = camera.registration != "software";
  if (!registered) {
    if (rig.depth.pinhole.width != pictures.width || rig.depth.pinhole.height != pictures.height)
      return Error{ErrorCode::kWrongUse,
                   path + ": in a log colour and depth have one size, the configuration gives two"};
    if (rig.depth.pinhole.fx <= 0 || rig.depth.pinhole.fy <= 0)
      return Error{ErrorCode::kWrongUse, path + ": to register its depth, camera.depth.fx ... must be known"};
  }
  auto index = readIndex(file, path, pictures);
  if (!index) return index.error();
  const std::vector<Entry>& entries = index->entries;
  const size_t total = entries.size();
  const auto frames = resolveRange(range, total, path, "the log");
  if (!frames) return frames.error();
  std::vector<Entry> asked(entries.begin() + static_cast<std::ptrdiff_t>(frames->first),
                           entries.begin() + static_cast<std::ptrdiff_t>(frames->last));
  return std::unique_ptr<FrameSource>(
      std::make_unique<KlgSource>(path, std::move(file), std::move(asked), *frames, total, index->oddity(),
                                  FrameMaker(rig, registered, camera.shrink), pictures));
}

}  // namespace comap
