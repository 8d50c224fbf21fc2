#include "edge_agent/capture/tum_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "edge_agent/capture/image_file.h"
#include "edge_agent/capture/tum_index.h"

namespace comap {
namespace {

std::string sizeText(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

template <class T>
void reverseRows(Image<T>& image) {
  for (int top = 0, bottom = image.height() - 1; top < bottom; ++top, --bottom) {
    std::swap_ranges(image.row(top), image.row(top) + image.width(), image.row(bottom));
  }
}

class TumSource final : public FrameSource {
 public:
  TumSource(std::string kind, std::string directory, TumRange range, size_t total, const TumCalibration& calibration,
            std::vector<TumPair> pairs)
      : kind_(std::move(kind)),
        directory_(std::move(directory)),
        range_(range),
        total_(total),
        camera_(calibration.camera),
        depth_scale_(calibration.depth_scale),
        y_up_(calibration.camera.fy < 0),
        pairs_(std::move(pairs)) {
    if (y_up_) {
      camera_.fy = -camera_.fy;
      camera_.cy = camera_.height - 1 - camera_.cy;
    }
  }

  Result<std::optional<Frame>> next() override {
    if (position_ == pairs_.size()) return std::optional<Frame>();
    const auto& pair = pairs_[position_++];
    auto colour = readColour(pair.colour_path);
    if (!colour) return colour.error();
    if (auto size = checkSize(*colour, pair.colour_path); !size) return size.error();
    auto depth = readDepth16(pair.depth_path);
    if (!depth) return depth.error();
    if (auto size = checkSize(*depth, pair.depth_path); !size) return size.error();
    toProjectUnit(*depth);
    if (y_up_) {
      reverseRows(*colour);
      reverseRows(*depth);
    }
    return std::optional<Frame>(Frame{pair.stamp_ns, camera_, std::move(*colour), std::move(*depth)});
  }

  size_t size() const override { return pairs_.size(); }

  std::string description() const override {
    return kind_ + " sequence " + directory_ + ", frames " + std::to_string(range_.first) + ":" +
           std::to_string(range_.last) + " of " + std::to_string(total_) + ", " +
           sizeText(camera_.width, camera_.height) + (y_up_ ? ", rows reversed as fy < 0" : "");
  }

 private:
  template <class T>
  Result<void> checkSize(const Image<T>& image, const std::string& path) const {
    if (image.width() == camera_.width && image.height() == camera_.height) return {};
    return Error{ErrorCode::kBadData, path + ": is " + sizeText(image.width(), image.height()) +
                                          " pixels, the calibration expects " +
                                          sizeText(camera_.width, camera_.height)};
  }

  void toProjectUnit(DepthImage& depth) const {
    if (depth_scale_ == kDepthUnitsPerMetre) return;
    const double factor = kDepthUnitsPerMetre / depth_scale_;
    for (uint16_t* value = depth.data(); value != depth.data() + depth.size(); ++value) {
      const double converted = std::floor(*value * factor + 0.5);
      *value = converted <= 65535 ? static_cast<uint16_t>(converted) : uint16_t{0};
    }
  }

  std::string kind_, directory_;
  TumRange range_;
  size_t total_;
  CameraModel camera_;
  double depth_scale_;
  bool y_up_;
  std::vector<TumPair> pairs_;
  size_t position_ = 0;
};

}  // namespace

Result<TumRange> resolveRange(TumRange range, size_t total, const std::string& path, const std::string& what) {
  if (range.last == TumRange::kToEnd) range.last = std::max(total, range.first);
  if (range.first < range.last && range.last <= total) return range;
  return Error{ErrorCode::kWrongUse, path + ": frames " + std::to_string(range.first) + ":" +
                                         std::to_string(range.last) + " asked, " + what + " has " +
                                         std::to_string(total)};
}

Result<std::unique_ptr<FrameSource>> openTum(const std::string& directory, TumRange range) {
  std::error_code problem;
  if (!std::filesystem::is_directory(directory, problem)) {
    return Error{ErrorCode::kUnreachable, directory + ": is not a folder that can be read"};
  }
  auto calibration = readTumCalibration((std::filesystem::path(directory) / "calibration.txt").string());
  if (!calibration) return calibration.error();
  auto pairs = readTumPairs(directory);
  if (!pairs) return pairs.error();
  return openTumPairs("TUM", directory, range, *calibration, std::move(*pairs));
}

Result<std::unique_ptr<FrameSource>> openTumPairs(const std::string& kind, const std::string& directory, TumRange range,
                                                  const TumCalibration& calibration, std::vector<TumPair> pairs) {
  const size_t total = pairs.size();
  if (total == 0) return Error{ErrorCode::kBadData, directory + ": lists no pair of colour and depth"};

  const auto asked = resolveRange(range, total, directory, "the sequence");
  if (!asked) return asked.error();
  pairs.erase(pairs.begin() + static_cast<std::ptrdiff_t>(asked->last), pairs.end());
  pairs.erase(pairs.begin(), pairs.begin() + static_cast<std::ptrdiff_t>(asked->first));
  std::error_code problem;
  for (const auto& pair : pairs) {
    for (const auto* path : {&pair.colour_path, &pair.depth_path}) {
      if (!std::filesystem::is_regular_file(*path, problem)) {
        return Error{ErrorCode::kUnreachable, *path + ": is listed by the sequence and is not there"};
      }
    }
  }
  return std::unique_ptr<FrameSource>(
      std::make_unique<TumSource>(kind, directory, *asked, total, calibration, std::move(pairs)));
}

}  // namespace comap
