#include "mapping_core/rgbd/pyramid.h"

#include <algorithm>

#include "mapping_core/rgbd/row_workers.h"

namespace comap {
namespace {

template <class T>
void resizeImage(Image<T>& image, int width, int height) {
  if (image.width() != width || image.height() != height) image = Image<T>(width, height);
}

void fillGrey(const ColourImage& colour, int row, Image<float>& grey) {
  const Rgb* in = colour.row(row);
  float* out = grey.row(row);
  for (int x = 0; x < colour.width(); ++x) {
    // Integer weights (x 1/1024) of 0.299, 0.587, 0.114.
    out[x] = static_cast<float>(306 * in[x].r + 601 * in[x].g + 117 * in[x].b) * (1.0f / 1024.0f);
  }
}

void fillDepth(const DepthImage& depth, int row, float min_m, float max_m, Image<float>& depth_m) {
  const auto* in = depth.row(row);
  float* out = depth_m.row(row);
  for (int x = 0; x < depth.width(); ++x) {
    const float d = static_cast<float>(in[x]) * static_cast<float>(1.0 / kDepthUnitsPerMetre);
    out[x] = d >= min_m && d <= max_m ? d : 0.0f;
  }
}

void halveGrey(const Image<float>& in, int begin, int end, Image<float>& out) {
  for (int y = begin; y < end; ++y) {
    const float* a = in.row(2 * y);
    const float* b = in.row(2 * y + 1);
    float* o = out.row(y);
    for (int x = 0; x < out.width(); ++x) o[x] = 0.25f * (a[2 * x] + a[2 * x + 1] + b[2 * x] + b[2 * x + 1]);
  }
}

void halveDepth(const Image<float>& in, int begin, int end, Image<float>& out) {
  constexpr float kFar = 1e9f;
  for (int y = begin; y < end; ++y) {
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

void fillLevels(const CameraModel& camera, Pyramid& pyramid, RowWorkers* workers) {
  pyramid[0].camera = camera;
  for (size_t l = 1; l < pyramid.size(); ++l) {
    pyramid[l].camera = pyramid[l - 1].camera.shrunk(2);
    resizeImage(pyramid[l].grey, pyramid[l - 1].grey.width() / 2, pyramid[l - 1].grey.height() / 2);
    shareRows(workers, pyramid[l].grey.height(),
              [&](int begin, int end) { halveGrey(pyramid[l - 1].grey, begin, end, pyramid[l].grey); });
  }
  shrinkDepth(pyramid, workers);
}

}  // namespace

void buildPyramid(const ColourImage& colour, const DepthImage& depth, const CameraModel& camera, int levels,
                  float depth_min_m, float depth_max_m, Pyramid& pyramid, RowWorkers* workers) {
  pyramid.resize(static_cast<size_t>(levels));
  resizeImage(pyramid[0].grey, colour.width(), colour.height());
  resizeImage(pyramid[0].depth_m, depth.width(), depth.height());
  shareRows(workers, colour.height(), [&](int begin, int end) {
    for (int y = begin; y < end; ++y) fillGrey(colour, y, pyramid[0].grey);
  });
  shareRows(workers, depth.height(), [&](int begin, int end) {
    for (int y = begin; y < end; ++y) fillDepth(depth, y, depth_min_m, depth_max_m, pyramid[0].depth_m);
  });
  fillLevels(camera, pyramid, workers);
}

void buildPyramid(const ColourImage& colour, const Image<float>& depth_m, const CameraModel& camera, int levels,
                  Pyramid& pyramid) {
  pyramid.resize(static_cast<size_t>(levels));
  resizeImage(pyramid[0].grey, colour.width(), colour.height());
  for (int y = 0; y < colour.height(); ++y) fillGrey(colour, y, pyramid[0].grey);
  pyramid[0].depth_m = depth_m;
  fillLevels(camera, pyramid, nullptr);
}

void shrinkDepth(Pyramid& pyramid, RowWorkers* workers) {
  for (size_t l = 1; l < pyramid.size(); ++l) {
    const Image<float>& fine = pyramid[l - 1].depth_m;
    resizeImage(pyramid[l].depth_m, fine.width() / 2, fine.height() / 2);
    shareRows(workers, pyramid[l].depth_m.height(),
              [&](int begin, int end) { halveDepth(fine, begin, end, pyramid[l].depth_m); });
  }
}

}  // namespace comap
