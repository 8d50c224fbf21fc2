#include "mapping_core/ferns/fern_encoder.h"

#include <algorithm>
#include <array>

namespace comap {
namespace {

constexpr float kMeanGrey = 110;

struct SmallImage {
  std::array<std::array<float, 3>, kFernImageWidth * kFernImageHeight> rgb{};
  std::array<uint16_t, kFernImageWidth * kFernImageHeight> depth_mm{};
};

SmallImage shrink(const ColourImage& colour, const DepthImage& depth) {
  SmallImage small;
  double total = 0;
  std::vector<uint16_t> samples;
  for (int cy = 0; cy < kFernImageHeight; ++cy) {
    const int y0 = cy * colour.height() / kFernImageHeight;
    const int y1 = std::max(y0 + 1, (cy + 1) * colour.height() / kFernImageHeight);
    for (int cx = 0; cx < kFernImageWidth; ++cx) {
      const int x0 = cx * colour.width() / kFernImageWidth;
      const int x1 = std::max(x0 + 1, (cx + 1) * colour.width() / kFernImageWidth);
      int r = 0, g = 0, b = 0;
      samples.clear();
      for (int y = y0; y < y1; ++y)
        for (int x = x0; x < x1; ++x) {
          const Rgb& c = colour.at(x, y);
          r += c.r;
          g += c.g;
          b += c.b;
          if (depth.at(x, y) != 0) samples.push_back(depth.at(x, y));
        }
      const size_t i = static_cast<size_t>(cy * kFernImageWidth + cx);
      const float n = static_cast<float>((x1 - x0) * (y1 - y0));
      small.rgb[i] = {static_cast<float>(r) / n, static_cast<float>(g) / n, static_cast<float>(b) / n};
      total += 0.299 * small.rgb[i][0] + 0.587 * small.rgb[i][1] + 0.114 * small.rgb[i][2];
      if (!samples.empty()) {
        const auto middle = samples.begin() + static_cast<long>(samples.size() / 2);
        std::nth_element(samples.begin(), middle, samples.end());
        small.depth_mm[i] = static_cast<uint16_t>(*middle / (kDepthUnitsPerMetre / 1000));
      }
    }
  }
  const float mean = static_cast<float>(total / (kFernImageWidth * kFernImageHeight));
  const float gain = std::clamp(mean > 0 ? kMeanGrey / mean : 1.0f, 0.5f, 2.0f);
  for (auto& pixel : small.rgb)
    for (float& channel : pixel) channel *= gain;
  return small;
}

}  // namespace

FernCode encodeFerns(const FernBook& book, const ColourImage& colour, const DepthImage& depth) {
  const SmallImage small = shrink(colour, depth);
  FernCode code;
  code.book_hash = book.hash();
  code.codes.reserve(book.ferns().size());
  for (const Fern& fern : book.ferns()) {
    const size_t i = static_cast<size_t>(fern.y * kFernImageWidth + fern.x);
    if (small.depth_mm[i] == 0) {
      code.codes.push_back(FernCode::kBad);
      continue;
    }
    const auto& rgb = small.rgb[i];
    code.codes.push_back(static_cast<uint8_t>((rgb[0] > fern.r) | (rgb[1] > fern.g) << 1 | (rgb[2] > fern.b) << 2 |
                                              (small.depth_mm[i] > fern.depth_mm) << 3));
  }
  return code;
}

}  // namespace comap
