#include "tests/protocol/codec/samples.h"

#include <algorithm>

namespace comap::samples {

int uniform(Random& random, int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); }

double real(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

std::string robot(Random& random) {
  static constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789_-";
  std::string name(static_cast<size_t>(uniform(random, 1, 32)), ' ');
  for (char& c : name) c = kLetters[static_cast<size_t>(uniform(random, 0, static_cast<int>(kLetters.size()) - 1))];
  return name;
}

KeyframeId id(Random& random) { return {robot(random), random(), static_cast<uint32_t>(random())}; }

std::string map(Random& random) {
  const KeyframeId anchor = id(random);
  return anchor.robot + "-" + std::to_string(anchor.session) + "-" + std::to_string(anchor.sequence);
}

Pose pose(Random& random) {
  Vector6d twist;
  for (int i = 0; i < 3; ++i) twist[i] = real(random, -100, 100);
  for (int i = 3; i < 6; ++i) twist[i] = real(random, -1.8, 1.8);
  return Pose::exp(twist);
}

Matrix6d information(Random& random) {
  Matrix6d a;
  for (int i = 0; i < 36; ++i) a(i / 6, i % 6) = real(random, -1e3, 1e3);
  return a * a.transpose();
}

Tile tile(Random& random, size_t surfels) {
  Tile tile{
      {map(random), static_cast<int32_t>(random()), static_cast<int32_t>(random()), static_cast<int32_t>(random())},
      random(),
      {}};
  for (size_t i = 0; i < surfels; ++i) {
    const uint64_t a = random(), b = random();
    const auto byte = [](uint64_t bits, int n) { return static_cast<uint8_t>(bits >> (8 * n)); };
    tile.surfels.push_back({static_cast<uint16_t>(a), static_cast<uint16_t>(a >> 16), static_cast<uint16_t>(a >> 32),
                            byte(a, 6), byte(a, 7), byte(b, 0), byte(b, 1), byte(b, 2), byte(b, 3), byte(b, 4),
                            byte(b, 5)});
  }
  for (int i = 0; i < static_cast<int>(surfels % 7); ++i) {
    TilePlace& place = tile.places.emplace_back();
    place.T_map_cam = pose(random);
    place.code.book_hash = random();
    place.code.codes.resize(500);
    for (uint8_t& code : place.code.codes)
      code = uniform(random, 0, 9) == 0 ? FernCode::kBad : static_cast<uint8_t>(uniform(random, 0, 15));
  }
  return tile;
}

Keyframe keyframe(Random& random, int width, int height) {
  Keyframe keyframe;
  keyframe.id = id(random);
  keyframe.id.sequence = std::max(1u, keyframe.id.sequence);  // a linked one is not the first
  keyframe.stamp_ns = static_cast<int64_t>(random());
  keyframe.camera = {real(random, 100, 900), real(random, 100, 900), width / 2.0, height / 2.0, width, height};
  keyframe.colour = ColourImage(width, height);
  keyframe.depth = DepthImage(width, height);
  const double slope = real(random, 2, 9);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      keyframe.colour.at(x, y) = {static_cast<uint8_t>(x * 2), static_cast<uint8_t>(y * 3),
                                  static_cast<uint8_t>((x * x + y * y) / 64)};
      const bool hole = (x / 13 + y / 7) % 11 == 0;
      keyframe.depth.at(x, y) = hole ? uint16_t{0} : static_cast<uint16_t>(5 * static_cast<int>(600 + slope * x + y));
    }
  }
  keyframe.fern_code.book_hash = random();
  keyframe.fern_code.codes.resize(500);
  for (uint8_t& code : keyframe.fern_code.codes) {
    code = uniform(random, 0, 9) == 0 ? FernCode::kBad : static_cast<uint8_t>(uniform(random, 0, 15));
  }
  keyframe.T_odom_cam = pose(random);
  keyframe.depth_hits = Image<uint8_t>((width + kHitBlock - 1) / kHitBlock, (height + kHitBlock - 1) / kHitBlock);
  for (size_t i = 0; i < keyframe.depth_hits.size(); ++i)
    keyframe.depth_hits.data()[i] = static_cast<uint8_t>(uniform(random, 0, 15));
  keyframe.linked = true;
  keyframe.linked_to = static_cast<uint32_t>(random()) % keyframe.id.sequence;
  keyframe.T_link_this = pose(random);
  keyframe.information = information(random);
  keyframe.inlier_ratio = real(random, 0, 1);
  return keyframe;
}

bool near(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm() < 1e-12 &&
         (a.rotation().coeffs() - b.rotation().coeffs()).norm() < 1e-12;
}

int abuse(Random& random, std::span<const uint8_t> bytes, const std::function<bool(std::span<const uint8_t>)>& decode) {
  int taken = 0;
  const size_t step = std::max<size_t>(1, bytes.size() / 300);
  // Copies of exact size on the heap, so that a sanitizer sees a read past the end.
  for (size_t length = 0; length < bytes.size(); length += step) {
    const std::vector<uint8_t> prefix(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
    taken += decode(prefix) ? 1 : 0;
  }
  for (int round = 0; round < 300; ++round) {
    std::vector<uint8_t> bad(bytes.begin(), bytes.end());
    for (int hits = uniform(random, 1, 8); hits > 0; --hits) {
      // The front holds the lengths: hit it as often as all the rest.
      const size_t reach = uniform(random, 0, 1) == 0 ? std::min<size_t>(bad.size(), 64) : bad.size();
      const auto at = static_cast<size_t>(random() % reach);
      switch (uniform(random, 0, 3)) {
        case 0:
          bad[at] = static_cast<uint8_t>(bad[at] ^ (1 << uniform(random, 0, 7)));
          break;
        case 1:
          bad[at] = 0xff;
          break;
        case 2:
          bad[at] = static_cast<uint8_t>(random());
          break;
        default:
          bad.insert(bad.begin() + static_cast<std::ptrdiff_t>(at), static_cast<size_t>(uniform(random, 1, 9)),
                     static_cast<uint8_t>(random()));
      }
    }
    taken += decode(bad) ? 1 : 0;
  }
  for (int round = 0; round < 200; ++round) {
    std::vector<uint8_t> noise(static_cast<size_t>(uniform(random, 0, 200)));
    for (uint8_t& byte : noise) byte = static_cast<uint8_t>(random());
    taken += decode(noise) ? 1 : 0;
  }
  return taken;
}

}  // namespace comap::samples
