// Procedural surfaces, drawn once into small pictures with mip levels.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace comap {

enum TextureId : int {
  kPlaster,
  kPlanks,
  kWood,
  kDarkWood,
  kBrick,
  kChecker,
  kStripes,
  kDamask,
  kFabric,
  kRug,
  kMarble,
  kBook,
  kLeaf,
  kWindowView,
  kScreen,
  kQuilt,
  kPaint,  ///< nearly plain, for scenes poor in texture
  kFirstPicture,
  kPictures = 12,
  kTextureCount = kFirstPicture + kPictures,
};

/// A square picture that repeats, with its mip levels; colours 0..1 as displayed.
class Texture {
 public:
  /// `draw(u, v)`, u and v in [0, 1), v upward, is sampled 2x2 per texel. `edge_m`: one repetition, in metres.
  template <class Draw>
  static Texture make(int edge_px, float edge_m, Draw draw);

  float edge_m() const { return edge_m_; }

  /// Trilinear; u, v in repetitions; `footprint` = size of the picture's pixel on the surface, in repetitions.
  Eigen::Vector3f sample(float u, float v, float footprint) const;

 private:
  struct Texel {
    uint8_t r = 0, g = 0, b = 0, unused = 0;
  };
  struct Level {
    int edge_px = 0;
    std::vector<Texel> texels;
  };
  static Eigen::Array4f bilinear(const Level& level, float u, float v);
  void addMips();

  float edge_m_ = 1;
  std::vector<Level> levels_;
};

/// All textures by TextureId; the seed varies pictures and grain.
std::vector<Texture> makeTextures(uint64_t seed, int threads);

}  // namespace comap
