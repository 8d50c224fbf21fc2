#include "protocol/codec/depth_codec.h"

#include <algorithm>
#include <string>

#include "protocol/codec/limits.h"
#include "protocol/codec/section.h"

namespace comap {
namespace {

constexpr uint8_t kFormat = 1;
constexpr size_t kHeaderBytes = 6, kSectionBytes = 8;
enum Predictor : uint8_t { kLeft = 0, kMedian = 1 };
enum Packing : uint8_t { kNibbles = 0, kBytes = 1 };
constexpr int kZstdLevel = 1;  // higher ones gain 1-3 % here for several times the time

bool sidesAllowed(int width, int height) {
  return width >= kMinImageSide && height >= kMinImageSide && width <= kMaxImageSide && height <= kMaxImageSide;
}

void putVarint(uint32_t value, std::vector<uint8_t>& to) {
  for (; value >= 0x80; value >>= 7) to.push_back(static_cast<uint8_t>(value | 0x80));
  to.push_back(static_cast<uint8_t>(value));
}

// False at the end of the bytes, or for more than three of them: no residual or level needs more.
bool takeVarint(const std::vector<uint8_t>& from, size_t& at, uint32_t& value) {
  value = 0;
  for (int shift = 0; shift < 21; shift += 7) {
    if (at >= from.size()) return false;
    const uint8_t byte = from[at++];
    value |= static_cast<uint32_t>(byte & 0x7f) << shift;
    if (byte < 0x80) return true;
  }
  return false;
}

void putNumber(uint32_t value, int bytes, std::vector<uint8_t>& to) {
  for (int i = 0; i < bytes; ++i) to.push_back(static_cast<uint8_t>(value >> (8 * i)));
}

uint32_t takeNumber(std::span<const uint8_t> from, size_t at, int bytes) {
  uint32_t value = 0;
  for (int i = 0; i < bytes; ++i) value |= static_cast<uint32_t>(from[at + static_cast<size_t>(i)]) << (8 * i);
  return value;
}

// Ranks with a row above and a column left of the image, so that every pixel has its three neighbours.
// Pixels without depth hold what was predicted for them.
class RankImage {
 public:
  RankImage(int width, int height)
      : stride_(static_cast<size_t>(width) + 1), ranks_(stride_ * (static_cast<size_t>(height) + 1), 0) {}
  int32_t* startRow(int y) {
    int32_t* row = ranks_.data() + (static_cast<size_t>(y) + 1) * stride_ + 1;
    row[-1] = row[-static_cast<ptrdiff_t>(stride_)];
    return row;
  }
  template <Predictor kPredictor>
  int32_t predict(const int32_t* pixel) const {
    const int32_t left = pixel[-1];
    if constexpr (kPredictor == kLeft) return left;
    const int32_t above = pixel[-static_cast<ptrdiff_t>(stride_)];
    const int32_t corner = pixel[-static_cast<ptrdiff_t>(stride_) - 1];
    const auto [low, high] = std::minmax(left, above);
    return std::clamp(left + above - corner, low, high);
  }

 private:
  size_t stride_;
  std::vector<int32_t> ranks_;
};

struct Levels {
  std::vector<uint16_t> depth;  // ascending, without 0
  std::vector<uint16_t> rank;   // of each possible depth
};

Levels findLevels(const DepthImage& depth) {
  std::vector<uint8_t> seen(65536, 0);
  for (size_t i = 0; i < depth.size(); ++i) seen[depth.data()[i]] = 1;
  Levels levels;
  levels.rank.resize(65536, 0);
  for (uint32_t value = 1; value < 65536; ++value) {
    if (seen[value] == 0) continue;
    levels.rank[value] = static_cast<uint16_t>(levels.depth.size());
    levels.depth.push_back(static_cast<uint16_t>(value));
  }
  return levels;
}

// One bit per pixel: does it have depth where the pixel above has none, or the reverse.
std::vector<uint8_t> packHoles(const DepthImage& depth) {
  std::vector<uint8_t> bits((depth.size() + 7) / 8, 0);
  const size_t width = static_cast<size_t>(depth.width());
  for (size_t i = 0; i < depth.size(); ++i) {
    const bool above = i >= width && depth.data()[i - width] != 0;
    if ((depth.data()[i] != 0) != above) bits[i / 8] = static_cast<uint8_t>(bits[i / 8] | (1u << (i % 8)));
  }
  return bits;
}

template <Predictor kPredictor>
std::vector<uint32_t> findResiduals(const DepthImage& depth, const Levels& levels) {
  std::vector<uint32_t> residuals;
  residuals.reserve(depth.size());
  RankImage ranks(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y) {
    int32_t* rank = ranks.startRow(y);
    const uint16_t* pixel = depth.row(y);
    for (int x = 0; x < depth.width(); ++x) {
      const int32_t predicted = ranks.predict<kPredictor>(rank + x);
      if (pixel[x] == 0) {
        rank[x] = predicted;
        continue;
      }
      rank[x] = levels.rank[pixel[x]];
      const int32_t error = rank[x] - predicted;
      residuals.push_back((static_cast<uint32_t>(error) << 1) ^ static_cast<uint32_t>(error >> 31));
    }
  }
  return residuals;
}

struct Packed {
  Predictor predictor = kLeft;
  Packing packing = kNibbles;
  std::vector<uint8_t> symbols, overflow;  // compressed
  uint32_t overflow_size = 0;              // before
  size_t size() const { return symbols.size() + overflow.size(); }
};

size_t symbolBytes(Packing packing, size_t valid) { return packing == kNibbles ? (valid + 1) / 2 : valid; }
uint32_t escapeOf(Packing packing) { return packing == kNibbles ? 15 : 255; }

Packed pack(const std::vector<uint32_t>& residuals, Predictor predictor) {
  const auto large = std::count_if(residuals.begin(), residuals.end(), [](uint32_t r) { return r >= 15; });
  Packed packed{predictor, static_cast<size_t>(large) * 8 < residuals.size() ? kNibbles : kBytes, {}, {}, 0};
  const uint32_t escape = escapeOf(packed.packing);
  std::vector<uint8_t> symbols(symbolBytes(packed.packing, residuals.size()), 0), overflow;
  for (size_t i = 0; i < residuals.size(); ++i) {
    const uint32_t symbol = std::min(residuals[i], escape);
    if (symbol == escape) putVarint(residuals[i] - escape, overflow);
    if (packed.packing == kNibbles) {
      symbols[i / 2] = static_cast<uint8_t>(symbols[i / 2] | symbol << (4 * (i % 2)));
    } else {
      symbols[i] = static_cast<uint8_t>(symbol);
    }
  }
  packed.overflow_size = static_cast<uint32_t>(overflow.size());
  packed.symbols = codec::compress(symbols, kZstdLevel);
  packed.overflow = codec::compress(overflow, kZstdLevel);
  return packed;
}

void putSection(uint32_t raw_size, const std::vector<uint8_t>& packed, std::vector<uint8_t>& to) {
  putNumber(raw_size, 4, to);
  putNumber(static_cast<uint32_t>(packed.size()), 4, to);
  to.insert(to.end(), packed.begin(), packed.end());
}

// The next section, at most `limit` bytes once unpacked.
Result<std::vector<uint8_t>> takeSection(std::span<const uint8_t> bytes, size_t& at, size_t limit, const char* name) {
  const std::string where = std::string("depth: section ") + name;
  if (bytes.size() - at < kSectionBytes) return Error{ErrorCode::kBadData, where + " is cut off"};
  const size_t raw_size = takeNumber(bytes, at, 4), packed_size = takeNumber(bytes, at + 4, 4);
  at += kSectionBytes;
  if (packed_size > bytes.size() - at) return Error{ErrorCode::kBadData, where + " is cut off"};
  if (raw_size > limit) {
    return Error{ErrorCode::kBadData,
                 where + " claims " + std::to_string(raw_size) + " bytes, expected at most " + std::to_string(limit)};
  }
  auto raw = codec::decompress(bytes.subspan(at, packed_size), raw_size, where);
  at += packed_size;
  return raw;
}

struct Sections {
  Packing packing = kNibbles;
  std::vector<uint16_t> levels;
  std::vector<uint8_t> valid;  // per pixel
  std::vector<uint8_t> symbols, overflow;
};

Result<std::vector<uint16_t>> readLevels(const std::vector<uint8_t>& steps) {
  std::vector<uint16_t> levels;
  uint32_t depth = 0, step = 0;
  for (size_t at = 0; at < steps.size();) {
    if (!takeVarint(steps, at, step) || step == 0 || depth + step > 65535) {
      return Error{ErrorCode::kBadData, "depth: levels do not ascend to at most 65535"};
    }
    depth += step;
    levels.push_back(static_cast<uint16_t>(depth));
  }
  return levels;
}

template <Predictor kPredictor>
Result<DepthImage> restore(const Sections& from, int width, int height) {
  DepthImage depth(width, height);
  RankImage ranks(width, height);
  const uint32_t escape = escapeOf(from.packing);
  const auto level_count = static_cast<int32_t>(from.levels.size());
  size_t next = 0, overflow_at = 0;
  for (int y = 0; y < height; ++y) {
    int32_t* rank = ranks.startRow(y);
    const uint8_t* valid = from.valid.data() + static_cast<size_t>(y) * static_cast<size_t>(width);
    for (int x = 0; x < width; ++x) {
      const int32_t predicted = ranks.predict<kPredictor>(rank + x);
      if (valid[x] == 0) {
        rank[x] = predicted;
        continue;
      }
      uint32_t residual =
          from.packing == kNibbles ? (from.symbols[next / 2] >> (4 * (next % 2))) & 15u : from.symbols[next];
      ++next;
      if (residual == escape) {
        uint32_t more = 0;
        if (!takeVarint(from.overflow, overflow_at, more)) {
          return Error{ErrorCode::kBadData, "depth: section overflow ends early"};
        }
        residual += more;
      }
      const int32_t error = static_cast<int32_t>(residual >> 1) ^ -static_cast<int32_t>(residual & 1);
      const int32_t value = predicted + error;
      if (value < 0 || value >= level_count) {
        return Error{ErrorCode::kBadData, "depth: pixel (" + std::to_string(x) + ", " + std::to_string(y) +
                                              ") names level " + std::to_string(value) + " of " +
                                              std::to_string(level_count)};
      }
      rank[x] = value;
      depth.at(x, y) = from.levels[static_cast<size_t>(value)];
    }
  }
  if (overflow_at != from.overflow.size()) return Error{ErrorCode::kBadData, "depth: section overflow is too long"};
  return depth;
}

}  // namespace

Result<std::vector<uint8_t>> encodeDepth(const DepthImage& depth) {
  if (!sidesAllowed(depth.width(), depth.height())) {
    return Error{ErrorCode::kWrongUse, "depth: " + std::to_string(depth.width()) + "x" +
                                           std::to_string(depth.height()) + " pixels, expected sides of " +
                                           std::to_string(kMinImageSide) + " to " + std::to_string(kMaxImageSide)};
  }
  const Levels levels = findLevels(depth);
  Packed best = pack(findResiduals<kLeft>(depth, levels), kLeft);
  if (Packed median = pack(findResiduals<kMedian>(depth, levels), kMedian); median.size() < best.size()) {
    best = std::move(median);
  }
  std::vector<uint8_t> steps;
  uint32_t before = 0;
  for (const uint16_t level : levels.depth) {
    putVarint(level - before, steps);
    before = level;
  }
  const std::vector<uint8_t> holes = packHoles(depth);
  const size_t valid = static_cast<size_t>(
      std::count_if(depth.data(), depth.data() + depth.size(), [](uint16_t value) { return value != 0; }));

  std::vector<uint8_t> bytes = {kFormat, static_cast<uint8_t>(best.predictor | best.packing << 4)};
  putNumber(static_cast<uint32_t>(depth.width()), 2, bytes);
  putNumber(static_cast<uint32_t>(depth.height()), 2, bytes);
  putSection(static_cast<uint32_t>(steps.size()), codec::compress(steps, kZstdLevel), bytes);
  putSection(static_cast<uint32_t>(holes.size()), codec::compress(holes, kZstdLevel), bytes);
  putSection(static_cast<uint32_t>(symbolBytes(best.packing, valid)), best.symbols, bytes);
  putSection(best.overflow_size, best.overflow, bytes);
  return bytes;
}

Result<DepthImage> decodeDepth(std::span<const uint8_t> bytes, int width, int height) {
  if (bytes.size() < kHeaderBytes) return Error{ErrorCode::kBadData, "depth: header is cut off"};
  if (bytes[0] != kFormat || (bytes[1] & 0xf) > kMedian || bytes[1] >> 4 > kBytes) {
    return Error{ErrorCode::kBadData, "depth: format " + std::to_string(bytes[0]) + " variant " +
                                          std::to_string(bytes[1]) +
                                          ", this build reads format 1 variants 0, 1, 16, 17"};
  }
  const int found_width = static_cast<int>(takeNumber(bytes, 2, 2)),
            found_height = static_cast<int>(takeNumber(bytes, 4, 2));
  if (!sidesAllowed(width, height) || found_width != width || found_height != height) {
    return Error{ErrorCode::kBadData, "depth: " + std::to_string(found_width) + "x" + std::to_string(found_height) +
                                          " pixels, expected " + std::to_string(width) + "x" + std::to_string(height)};
  }
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  size_t at = kHeaderBytes;
  Sections sections;
  sections.packing = static_cast<Packing>(bytes[1] >> 4);

  const auto steps = takeSection(bytes, at, 3 * 65535, "levels");
  if (!steps) return steps.error();
  auto levels = readLevels(*steps);
  if (!levels) return levels.error();
  sections.levels = std::move(*levels);

  const auto holes = takeSection(bytes, at, (pixels + 7) / 8, "holes");
  if (!holes) return holes.error();
  if (holes->size() != (pixels + 7) / 8) return Error{ErrorCode::kBadData, "depth: section holes is too short"};
  sections.valid.resize(pixels);
  size_t valid = 0;
  for (size_t i = 0; i < pixels; ++i) {
    const uint8_t above = i >= static_cast<size_t>(width) ? sections.valid[i - static_cast<size_t>(width)] : uint8_t{0};
    sections.valid[i] = static_cast<uint8_t>(above ^ (((*holes)[i / 8] >> (i % 8)) & 1));
    valid += sections.valid[i];
  }

  const size_t symbol_bytes = symbolBytes(sections.packing, valid);
  auto symbols = takeSection(bytes, at, symbol_bytes, "symbols");
  if (!symbols) return symbols.error();
  if (symbols->size() != symbol_bytes) return Error{ErrorCode::kBadData, "depth: section symbols is too short"};
  sections.symbols = std::move(*symbols);
  auto overflow = takeSection(bytes, at, 3 * valid, "overflow");
  if (!overflow) return overflow.error();
  sections.overflow = std::move(*overflow);
  if (at != bytes.size()) return Error{ErrorCode::kBadData, "depth: bytes follow the last section"};

  return (bytes[1] & 0xf) == kLeft ? restore<kLeft>(sections, width, height)
                                   : restore<kMedian>(sections, width, height);
}

}  // namespace comap
