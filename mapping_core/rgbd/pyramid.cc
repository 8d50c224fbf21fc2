#include "mapping_core/rgbd/pyramid.h"

#include <algorithm>

namespace comap {
namespace {

template <class T>
void resizeImage(Image<T>& image, int width, int height) {
  if (image.width() != width || image.height() != height) image = Image<T>(width, height);
}

void fillGrey(const ColourImage& colour, Image<float>& grey) {
  resizeImage(grey, colour.width(), colour.height());
  const Rgb* in = colour.data();
  float* out = grey.data();
  for (size_t i = 0; i < colour.size(); ++i) {
    // Integer weights (x 1/1024) of 0.299, 0.587, 0.114.
    out[i] = static_cast<float>(306 * in[i].r + 601 * in[i].g + 117 * in[i].b) * (1.0f / 1024.0f);
  }
}

void halveGrey(const Image<float>& in, Image<float>& out) {
  resizeImage(out, in.width() / 2, in.height() / 2);
  for (int y = 0; y < out.height(); ++y) {
    const float* a = in.row(2 * y);
    const float* b = in.row(2 * y + 1);
    float* o = out.row(y);
    for (int x = 0; x < out.width(); ++x) o[x] = 0.25f * (a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1]);
  }
}

void halveDepth(const Image<float>& in, Image<float>& out) {
  resizeImage(out, in.width() / 2, in.height() / 2);
  constexpr float kFar = 1e9f;
  for (int y = 0; y < out.height(); ++y) {
    const float* a = in.row(2 * y);
    const float* b = in.row(2 * y + 1);
    float* o = out.row(y);
    for (int x = 0; x < out.width(); ++x) {
      const float d[4] = {a[2 * x], a[2 * x + 1], b[2 * x], b[2 * x + 1]};
      float nearest = kFar;
      for (const float v : d) nearest = std::min(nearest, v > 0 ? v : kFar);
      // Jump gate: 3 cm at 1 m, growing with depth as sensor noise does.
      const float limit = nearest + 0.02f + 0.01f * nearest * nearest;
      float sum = 0, count = 0;
      for (const float v : d) {
        const float use = v > 0 && v <= limit ? 1.0f : 0.0f;
        sum += use * v;
        count += use;
      }
      o[x] = count > 0 ? sum / count : 0.0f;
    }
  }
}

void fillLevels(const CameraModel& camera, Pyramid& pyramid) {
  pyramid[0].camera = camera;
  for (size_t l = 1; l < pyramid.size(); ++l) {
    pyramid[l].camera = pyramid[l - 1].camera.shrunk(2);
    halveGrey(pyramid[l - 1].grey, pyramid[l].grey);
    halveDepth(pyramid[l - 1].depth_m, pyramid[l].depth_m);
  }
}

}  // namespace

void buildPyramid(const ColourImage& colour, const DepthImage& depth, const CameraModel& camera, int levels,
                  float depth_min_m, float depth_max_m, Pyramid& pyramid) {
  pyramid.resize(static_cast<size_t>(levels));
  fillGrey(colour, pyramid[0].grey);
  resizeImage(pyramid[0].depth_m, depth.width(), depth.height());
  float* out = pyramid[0].depth_m.data();
  for (size_t i = 0; i < depth.size(); ++i) {
    const float d = static_cast<float>(depth.data()[i]) * static_cast<float>(1.0 / kDepthUnitsPerMetre);
    out[i] = d >= depth_min_m && d <= depth_max_m ? d : 0.0f;
  }
  fillLevels(camera, pyramid);
}

void buildPyramid(const ColourImage& colour, const Image<float>& depth_m, const CameraModel& camera, int levels,
                  Pyramid& pyramid) {
  pyramid.resize(static_cast<size_t>(levels));
  fillGrey(colour, pyramid[0].grey);
  pyramid[0].depth_m = depth_m;
  fillLevels(camera, pyramid);
}

void shrinkDepth(Pyramid& pyramid) {
  for (size_t l = 1; l < pyramid.size(); ++l) halveDepth(pyramid[l - 1].depth_m, pyramid[l].depth_m);
}

}  // namespace comap
