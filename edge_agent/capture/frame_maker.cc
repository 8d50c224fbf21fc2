#include "edge_agent/capture/frame_maker.h"

#include "edge_agent/capture/picture_convert.h"

namespace comap {
namespace {

Error wrongSize(const char* what, int width, int height, int expected_width, int expected_height) {
  return {ErrorCode::kBadData, std::string(what) + " picture is " + std::to_string(width) + "x" +
                                   std::to_string(height) + ", the calibration is for " +
                                   std::to_string(expected_width) + "x" + std::to_string(expected_height)};
}

ColourImage averaged(const ColourImage& image, int factor) {
  ColourImage made(image.width() / factor, image.height() / factor);
  const int count = factor * factor;
  for (int y = 0; y < made.height(); ++y) {
    for (int x = 0; x < made.width(); ++x) {
      int r = count / 2, g = count / 2, b = count / 2;
      for (int j = 0; j < factor; ++j) {
        const Rgb* from = image.row(y * factor + j) + x * factor;
        for (int i = 0; i < factor; ++i) {
          r += from[i].r;
          g += from[i].g;
          b += from[i].b;
        }
      }
      made.at(x, y) = {static_cast<uint8_t>(r / count), static_cast<uint8_t>(g / count),
                       static_cast<uint8_t>(b / count)};
    }
  }
  return made;
}

}  // namespace

FrameMaker::FrameMaker(const CameraRig& rig, bool depth_is_registered, int shrink)
    : colour_(rig.colour),
      shrink_(shrink),
      camera_(shrink == 1 ? rig.colour.pinhole : rig.colour.pinhole.shrunk(shrink)),
      undistorter_(rig.colour),
      registration_(rig, camera_, depth_is_registered) {}

Result<Frame> FrameMaker::make(const PicturePair& pair) {
  auto colour = toColour(pair.colour);
  if (!colour) return colour.error();
  const CameraModel& lens = colour_.pinhole;
  if (colour->width() != lens.width || colour->height() != lens.height)
    return wrongSize("colour", colour->width(), colour->height(), lens.width, lens.height);
  auto values = toDepthValues(pair.depth);
  if (!values) return values.error();
  if (values->width() != registration_.width() || values->height() != registration_.height())
    return wrongSize("depth", values->width(), values->height(), registration_.width(), registration_.height());
  ColourImage straight = undistorter_.apply(std::move(*colour));
  return Frame{pair.colour.stamp_ns, camera_, shrink_ == 1 ? std::move(straight) : averaged(straight, shrink_),
               registration_.apply(*values)};
}

}  // namespace comap
