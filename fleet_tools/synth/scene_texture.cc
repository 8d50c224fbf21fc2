#include "fleet_tools/synth/scene_texture.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "fleet_tools/synth/synth_parallel.h"
#include "fleet_tools/synth/synth_random.h"

namespace comap {
namespace {

using Eigen::Vector3f;

constexpr float kTau = 6.2831853f;

float smooth(float s) { return s * s * (3 - 2 * s); }
float fraction(float x) { return x - std::floor(x); }
float mixed(float a, float b, float s) { return a + (b - a) * s; }
Vector3f mixed(const Vector3f& a, const Vector3f& b, float s) { return a + (b - a) * std::clamp(s, 0.0f, 1.0f); }
Vector3f rgb(int r, int g, int b) {
  return Vector3f(static_cast<float>(r), static_cast<float>(g), static_cast<float>(b)) / 255.0f;
}

uint64_t cellBits(int x, int y, uint64_t seed) {
  return mixBits(seed, static_cast<uint64_t>(static_cast<uint32_t>(x)) << 32 | static_cast<uint32_t>(y));
}

// Value noise on [0, 1)^2 with nx x ny cells, periodic. 0..1
float noise(float u, float v, int nx, int ny, uint64_t seed) {
  const float x = fraction(u) * static_cast<float>(nx), y = fraction(v) * static_cast<float>(ny);
  const int x0 = static_cast<int>(x) % nx, y0 = static_cast<int>(y) % ny;
  const int x1 = (x0 + 1) % nx, y1 = (y0 + 1) % ny;
  const float s = smooth(fraction(x)), t = smooth(fraction(y));
  const auto at = [&](int i, int j) { return unitFloat(cellBits(i, j, seed)); };
  return mixed(mixed(at(x0, y0), at(x1, y0), s), mixed(at(x0, y1), at(x1, y1), s), t);
}

float fractal(float u, float v, int nx, int ny, int octaves, uint64_t seed) {
  float sum = 0, weight = 0.5f, total = 0;
  for (int i = 0; i < octaves; ++i, nx *= 2, ny *= 2, weight *= 0.6f) {
    sum += weight * noise(u, v, nx, ny, seed + static_cast<uint64_t>(i));
    total += weight;
  }
  return sum / total;
}

Vector3f plaster(float u, float v, uint64_t seed) {
  const float rough = fractal(u, v, 12, 12, 5, seed), blotch = fractal(u, v, 3, 3, 2, seed + 9);
  return Vector3f::Constant(0.62f + 0.34f * rough + 0.14f * (blotch - 0.5f));
}

Vector3f planks(float u, float v, uint64_t seed) {
  constexpr int kRows = 12;
  const float y = fraction(v) * kRows;
  const int row = static_cast<int>(y);
  const float x = fraction(u + unitFloat(cellBits(row, 1, seed))) * 2;
  const int plank = row * 7 + static_cast<int>(x);
  const float tone = unitFloat(cellBits(plank, 2, seed));
  const float shift = unitFloat(cellBits(plank, 3, seed));
  const float grain = fractal(u + shift, v + shift, 6, 160, 3, seed + 4);
  Vector3f colour = mixed(rgb(150, 96, 52), rgb(214, 160, 104), 0.55f * tone + 0.6f * (grain - 0.2f));
  const float gap = std::min({fraction(y), 1 - fraction(y), 14 * std::min(fraction(x), 1 - fraction(x))});
  return gap < 0.035f ? Vector3f(colour * 0.4f) : colour;
}

Vector3f wood(float u, float v, uint64_t seed, const Vector3f& dark, const Vector3f& light) {
  const float bend = fractal(u, v, 3, 5, 3, seed);
  const float rings = 0.5f + 0.5f * std::sin(kTau * (6 * v + 2.2f * bend));
  const float fine = fractal(u, v, 5, 120, 2, seed + 5);
  return mixed(dark, light, 0.55f * rings * rings + 0.5f * fine);
}

Vector3f brick(float u, float v, uint64_t seed) {
  constexpr int kColumns = 4, kRows = 12;
  const float y = fraction(v) * kRows;
  const int row = static_cast<int>(y);
  const float x = fraction(u + (row % 2 == 0 ? 0.0f : 0.5f / kColumns)) * kColumns;
  const float fx = fraction(x) * 3, fy = fraction(y);
  const float rough = fractal(u, v, 30, 30, 3, seed);
  if (fx < 0.12f || fx > 2.88f || fy < 0.12f || fy > 0.88f) return Vector3f::Constant(0.55f + 0.3f * rough);
  const float tone = unitFloat(cellBits(static_cast<int>(x), row, seed + 1));
  return mixed(rgb(120, 52, 38), rgb(206, 122, 88), 0.65f * tone + 0.5f * (rough - 0.25f));
}

Vector3f checker(float u, float v, uint64_t seed) {
  const int x = static_cast<int>(fraction(u) * 6), y = static_cast<int>(fraction(v) * 6);
  const float rough = fractal(u, v, 18, 18, 4, seed), tone = unitFloat(cellBits(x, y, seed));
  const bool dark = (x + y) % 2 == 0;
  const float gap = std::min({fraction(u * 6), fraction(v * 6)});
  if (gap < 0.03f) return Vector3f::Constant(0.35f);
  return (dark ? rgb(92, 96, 104) : rgb(206, 200, 186)) * (0.78f + 0.22f * rough + 0.12f * tone);
}

Vector3f stripes(float u, float v, uint64_t seed) {
  const float x = fraction(u) * 8;
  const int stripe = static_cast<int>(x);
  static const Vector3f kColours[] = {rgb(196, 178, 140), rgb(150, 170, 160), rgb(214, 204, 180), rgb(120, 146, 150)};
  const float weave = fractal(u, v, 60, 60, 2, seed);
  Vector3f colour = kColours[stripe % 4] * (0.84f + 0.24f * weave);
  // Small flowers on the lighter stripes, each a little different.
  if (stripe % 2 == 0) {
    const float y = fraction(v) * 10;
    const int row = static_cast<int>(y);
    const float jx = unitFloat(cellBits(stripe, row, seed)) * 0.3f, jy = unitFloat(cellBits(row, stripe, seed)) * 0.3f;
    const float dx = fraction(x) - 0.35f - jx, dy = fraction(y) - 0.35f - jy;
    const float petals = 0.16f + 0.08f * std::cos(5 * std::atan2(dy, dx));
    if (dx * dx + dy * dy < petals * petals) colour = mixed(rgb(160, 60, 70), rgb(80, 100, 60), weave * 1.2f);
  }
  return colour;
}

Vector3f damask(float u, float v, uint64_t seed) {
  const float x = u * 4, y = v * 4 + 0.5f * static_cast<float>(static_cast<int>(fraction(u) * 4) % 2);
  const float a = fraction(x) - 0.5f, b = fraction(y) - 0.5f;
  const float angle = std::atan2(b, std::abs(a)), radius = std::sqrt(a * a + b * b);
  const float leaf = 0.30f + 0.13f * std::cos(6 * angle) + 0.05f * std::sin(11 * radius * kTau);
  const float weave = fractal(u, v, 50, 50, 3, seed), wear = fractal(u, v, 4, 4, 3, seed + 7);
  const Vector3f ground = mixed(rgb(150, 116, 92), rgb(182, 150, 118), wear);
  return (radius < leaf ? mixed(rgb(206, 186, 146), rgb(232, 216, 178), wear) : ground) * (0.82f + 0.28f * weave);
}

Vector3f fabric(float u, float v, uint64_t seed) {
  const float warp = std::sin(kTau * 64 * u), weft = std::sin(kTau * 64 * v);
  const float blotch = fractal(u, v, 14, 14, 4, seed);
  return Vector3f::Constant(0.5f + 0.5f * blotch + 0.07f * warp * weft);
}

Vector3f rug(float u, float v, uint64_t seed) {
  const float x = std::abs(fraction(u) - 0.5f) * 2, y = std::abs(fraction(v) - 0.5f) * 2;
  const float border = std::max(x, y), wool = fractal(u, v, 80, 80, 2, seed);
  Vector3f colour = rgb(150, 40, 44);
  if (border > 0.94f) {
    colour = rgb(226, 208, 170);
  } else if (border > 0.78f) {
    const float band = fraction((x > y ? v : u) * 14);
    colour = band < 0.5f ? rgb(28, 44, 88) : rgb(206, 160, 80);
  } else {
    const float diamond = fraction(3 * (x + y)), star = std::sin(9 * x) * std::sin(11 * y);
    if (diamond < 0.22f) colour = rgb(222, 190, 120);
    if (star > 0.45f) colour = rgb(40, 66, 110);
    if (star < -0.5f) colour = rgb(70, 92, 60);
  }
  return colour * (0.7f + 0.5f * wool);
}

Vector3f marble(float u, float v, uint64_t seed) {
  const float swirl = fractal(u, v, 4, 4, 5, seed);
  const float vein = std::abs(std::sin(kTau * (2 * u + v + 2.5f * swirl)));
  return mixed(rgb(110, 112, 120), rgb(226, 222, 216), std::pow(vein, 0.4f));
}

Vector3f book(float u, float v, uint64_t seed) {
  const float rough = fractal(u, v, 8, 24, 3, seed);
  Vector3f colour = Vector3f::Constant(0.72f + 0.25f * rough);
  const bool band = (v > 0.82f && v < 0.87f) || (v > 0.12f && v < 0.16f);
  const bool title = u > 0.3f && u < 0.7f && v > 0.32f && v < 0.76f && noise(u, v, 3, 37, seed + 3) > 0.45f;
  if (band || title) colour = Vector3f(1.25f, 1.15f, 0.8f);
  return colour;
}

Vector3f leaf(float u, float v, uint64_t seed) {
  const float spots = fractal(u, v, 10, 10, 4, seed), vein = fraction(8 * u + 2 * std::abs(fraction(6 * v) - 0.5f));
  return mixed(rgb(24, 60, 24), rgb(118, 168, 72), 1.3f * (spots - 0.15f)) * (vein < 0.1f ? 1.25f : 1.0f);
}

Vector3f windowView(float u, float v, uint64_t seed) {
  const bool frame = std::min({u, 1 - u, v, 1 - v, std::abs(u - 0.5f)}) < 0.035f || std::abs(v - 0.66f) < 0.02f;
  if (frame) return rgb(232, 228, 220);
  const float cloud = fractal(u, v, 4, 6, 4, seed);
  const float hill = 0.38f + 0.1f * std::sin(5 * u + 1) + 0.05f * fractal(u, 0.3f, 20, 1, 2, seed + 3);
  const float tree = fractal(u, v, 24, 24, 3, seed + 5);
  if (v < hill) return mixed(rgb(40, 70, 30), rgb(140, 160, 84), tree + 0.4f * (v / hill - 0.5f));
  return mixed(rgb(126, 170, 222), rgb(244, 246, 248), 1.6f * (cloud - 0.3f));
}

Vector3f screen(float u, float v, uint64_t seed) {
  if (std::min({u, 1 - u, v, 1 - v}) < 0.04f) return rgb(24, 24, 26);
  if (v > 0.9f) return rgb(70, 90, 130);
  const bool text = noise(u, v, 40, 1, seed + static_cast<uint64_t>(v * 26)) > 0.5f && fraction(v * 26) > 0.45f;
  const bool indented = u > 0.08f + 0.05f * static_cast<float>(cellBits(static_cast<int>(v * 26), 0, seed) % 5);
  const bool within = u < 0.35f + 0.5f * unitFloat(cellBits(static_cast<int>(v * 26), 1, seed));
  return text && indented && within ? rgb(170, 210, 160) : rgb(34, 38, 46);
}

Vector3f quilt(float u, float v, uint64_t seed) {
  const int x = static_cast<int>(fraction(u) * 5), y = static_cast<int>(fraction(v) * 5);
  const uint64_t bits = cellBits(x, y, seed);
  const Vector3f first(0.25f + 0.6f * unitFloat(bits), 0.25f + 0.5f * unitFloat(mixBits(bits)),
                       0.3f + 0.5f * unitFloat(mixBits(bits, 1)));
  const float a = fraction(u * 5) - 0.5f, b = fraction(v * 5) - 0.5f;
  const bool inner = bits % 3 == 0 ? std::abs(a) + std::abs(b) < 0.35f
                                   : (bits % 3 == 1 ? a * a + b * b < 0.1f : fraction(4 * (a + b)) < 0.5f);
  const float weave = fractal(u, v, 60, 60, 2, seed + 3);
  return (inner ? Vector3f(Vector3f::Constant(1.05f) - first) : first) * (0.75f + 0.4f * weave);
}

Vector3f paint(float u, float v, uint64_t seed) {
  return Vector3f::Constant(0.83f + 0.05f * fractal(u, v, 3, 3, 2, seed) + 0.025f * fractal(u, v, 60, 60, 2, seed + 5));
}

// A framed composition of discs, bars and waves, one of its own for each seed.
std::function<Vector3f(float, float)> picture(uint64_t seed) {
  struct Mark {
    float x, y, size, c, s, kind;
    Vector3f colour;
  };
  RandomStream random(seed);
  const auto colour = [&] {
    return Vector3f(random.uniform(0.05f, 0.98f), random.uniform(0.05f, 0.95f), random.uniform(0.05f, 0.95f));
  };
  const Vector3f sky = colour(), ground = colour(), frame = colour() * 0.5f;
  std::vector<Mark> marks;
  for (int i = 0; i < 22; ++i) {
    const float x = random.uniform(0.1f, 0.9f), y = random.uniform(0.1f, 0.9f), size = random.uniform(0.03f, 0.2f);
    const float angle = random.uniform(0, kTau), kind = random.uniform(0, 3);
    marks.push_back({x, y, size, std::cos(angle), std::sin(angle), kind, colour()});
  }
  return [=](float u, float v) {
    const float edge = std::min({u, 1 - u, v, 1 - v});
    if (edge < 0.05f) return Vector3f(frame * (0.7f + 6 * edge));
    if (edge < 0.09f) return Vector3f(rgb(236, 230, 216));
    const float canvas = fractal(u, v, 24, 24, 3, seed);
    Vector3f result = mixed(ground, sky, v + 0.25f * (canvas - 0.5f));
    for (const auto& mark : marks) {
      const float a = (mark.c * (u - mark.x) + mark.s * (v - mark.y)) / mark.size;
      const float b = (mark.c * (v - mark.y) - mark.s * (u - mark.x)) / mark.size;
      if (a * a + b * b > 3) continue;
      const bool inside = mark.kind < 1   ? a * a + b * b < 0.6f
                          : mark.kind < 2 ? std::abs(a) < 1.3f && std::abs(b) < 0.22f
                                          : std::abs(b - 0.3f * std::sin(5 * a)) < 0.13f && std::abs(a) < 1.6f;
      if (inside) result = mark.colour;
    }
    return Vector3f(result * (0.8f + 0.35f * canvas));
  };
}

}  // namespace

template <class Draw>
Texture Texture::make(int edge_px, float edge_m, Draw draw) {
  Texture texture;
  texture.edge_m_ = edge_m;
  Level level{edge_px, std::vector<Texel>(static_cast<size_t>(edge_px) * static_cast<size_t>(edge_px))};
  const float step = 1.0f / static_cast<float>(edge_px);
  for (int y = 0; y < edge_px; ++y) {
    for (int x = 0; x < edge_px; ++x) {
      Vector3f sum = Vector3f::Zero();
      for (int sub = 0; sub < 4; ++sub) {
        sum += draw((static_cast<float>(x) + 0.25f + 0.5f * static_cast<float>(sub % 2)) * step,
                    (static_cast<float>(y) + 0.25f + 0.5f * static_cast<float>(sub / 2)) * step);
      }
      // Up to 1.25 so that a tint can be brightened: 204 stands for 1.
      const Vector3f value = (sum * (204.0f / 4)).array().max(0.0f).min(255.0f).round();
      level.texels[static_cast<size_t>(y * edge_px + x)] = {
          static_cast<uint8_t>(value[0]), static_cast<uint8_t>(value[1]), static_cast<uint8_t>(value[2])};
    }
  }
  texture.levels_.push_back(std::move(level));
  texture.addMips();
  return texture;
}

void Texture::addMips() {
  while (levels_.back().edge_px > 1) {
    const Level& fine = levels_.back();
    const int edge = fine.edge_px / 2;
    Level coarse{edge, std::vector<Texel>(static_cast<size_t>(edge) * static_cast<size_t>(edge))};
    for (int y = 0; y < edge; ++y) {
      for (int x = 0; x < edge; ++x) {
        const auto at = [&](int dx, int dy) {
          return fine.texels[static_cast<size_t>((2 * y + dy) * fine.edge_px + 2 * x + dx)];
        };
        const Texel a = at(0, 0), b = at(1, 0), c = at(0, 1), d = at(1, 1);
        coarse.texels[static_cast<size_t>(y * edge + x)] = {static_cast<uint8_t>((a.r + b.r + c.r + d.r + 2) / 4),
                                                            static_cast<uint8_t>((a.g + b.g + c.g + d.g + 2) / 4),
                                                            static_cast<uint8_t>((a.b + b.b + c.b + d.b + 2) / 4)};
      }
    }
    levels_.push_back(std::move(coarse));
  }
}

Eigen::Array4f Texture::bilinear(const Level& level, float u, float v) {
  const float x = u * static_cast<float>(level.edge_px) + 0.5f, y = v * static_cast<float>(level.edge_px) + 0.5f;
  const int mask = level.edge_px - 1;  // edges are powers of two
  const int xi = static_cast<int>(x), yi = static_cast<int>(y);
  const float s = x - static_cast<float>(xi), t = y - static_cast<float>(yi);
  const auto at = [&](int i, int j) {
    const Texel texel = level.texels[static_cast<size_t>(((j & mask) * level.edge_px) + (i & mask))];
    return Eigen::Array4f(texel.r, texel.g, texel.b, 0);
  };
  const Eigen::Array4f low = at(xi - 1, yi - 1) * (1 - s) + at(xi, yi - 1) * s;
  const Eigen::Array4f high = at(xi - 1, yi) * (1 - s) + at(xi, yi) * s;
  return low * (1 - t) + high * t;
}

Eigen::Vector3f Texture::sample(float u, float v, float footprint) const {
  const float level = std::log2(std::max(1e-6f, footprint * static_cast<float>(levels_[0].edge_px)));
  const float clamped = std::clamp(level, 0.0f, static_cast<float>(levels_.size()) - 1.001f);
  const size_t low = static_cast<size_t>(clamped);
  const float s = clamped - static_cast<float>(low);
  const float fu = fraction(u), fv = fraction(v);
  Eigen::Array4f result = bilinear(levels_[low], fu, fv);
  if (s > 0.02f) result += (bilinear(levels_[low + 1], fu, fv) - result) * s;
  return result.head<3>().matrix() * (1.0f / 204.0f);
}

std::vector<Texture> makeTextures(uint64_t seed, int threads) {
  using Draw = std::function<Vector3f(float, float)>;
  struct Plan {
    int edge_px = 512;
    float edge_m = 1;
    Draw draw;
  };
  std::vector<Plan> plans(kTextureCount);
  const auto plan = [&](TextureId id, int edge_px, float edge_m, auto draw) {
    const uint64_t own = mixBits(seed, static_cast<uint64_t>(id) + 1);
    plans[id] = {edge_px, edge_m, [=](float u, float v) { return Vector3f(draw(u, v, own)); }};
  };
  plan(kPlaster, 512, 1.28f, plaster);
  plan(kPlanks, 512, 1.44f, planks);
  plan(kWood, 512, 0.9f,
       [](float u, float v, uint64_t own) { return wood(u, v, own, rgb(128, 80, 44), rgb(208, 152, 96)); });
  plan(kDarkWood, 512, 0.9f,
       [](float u, float v, uint64_t own) { return wood(u, v, own, rgb(52, 30, 22), rgb(122, 78, 52)); });
  plan(kBrick, 512, 0.96f, brick);
  plan(kChecker, 512, 1.2f, checker);
  plan(kStripes, 512, 0.96f, stripes);
  plan(kDamask, 512, 1.1f, damask);
  plan(kFabric, 512, 0.64f, fabric);
  plan(kRug, 512, 1.0f, rug);
  plan(kMarble, 512, 0.8f, marble);
  plan(kBook, 128, 0.25f, book);
  plan(kLeaf, 256, 1.0f, leaf);
  plan(kWindowView, 512, 1.0f, windowView);
  plan(kScreen, 256, 1.0f, screen);
  plan(kQuilt, 512, 1.0f, quilt);
  plan(kPaint, 512, 1.28f, paint);
  for (int i = 0; i < kPictures; ++i) {
    const int id = kFirstPicture + i;
    plans[static_cast<size_t>(id)] = {256, 1.0f, picture(mixBits(seed, static_cast<uint64_t>(id) + 1))};
  }
  std::vector<Texture> textures(kTextureCount);
  parallelFor(kTextureCount, threads, [&](int i) {
    const Plan& p = plans[static_cast<size_t>(i)];
    textures[static_cast<size_t>(i)] = Texture::make(p.edge_px, p.edge_m, p.draw);
  });
  return textures;
}

}  // namespace comap
