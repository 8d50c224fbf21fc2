#include "fleet_tools/replay/run_map.h"

#include <fstream>

#include "edge_agent/capture/image_file.h"
#include "fleet_tools/export/ply.h"
#include "fleet_tools/render/surfel_renderer.h"

namespace comap {
namespace {

struct Picture {
  const char* name;
  const char* title;
  Colouring colouring;
  bool from_above;
};

constexpr Picture kPictures[] = {{"map.png", "The joint map", Colouring::kRgb, false},
                                 {"map-top.png", "From above", Colouring::kRgb, true},
                                 {"map-contribution.png", "Who contributed what", Colouring::kContribution, false}};
constexpr int kPictureWidth = 1280, kPictureHeight = 800;

Result<std::vector<uint8_t>> readBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  return bytes;
}

}  // namespace

Result<void> writeMapPly(const std::string& path, std::span<const Surfel> surfels) {
  std::vector<MapPoint> points;
  points.reserve(surfels.size());
  for (const Surfel& surfel : surfels)
    points.push_back({surfel.position, surfel.normal, surfel.colour, surfel.radius, surfel.confidence});
  return writePly(path, points);
}

Result<std::vector<ReportPicture>> paintMap(const std::string& folder, const std::string& device_choice, size_t robots,
                                            const std::vector<Surfel>& surfels, const std::vector<Pose>& T_map_cams) {
  gpu::DeviceOptions device_options;
  device_options.choice = device_choice;
  device_options.cache_directory = gpu::defaultCacheDirectory();
  auto device = gpu::Device::create(device_options);
  if (!device) return device.error();
  const Eigen::Vector3d up = upDirection(surfels, T_map_cams);
  std::vector<ReportPicture> pictures;
  for (const Picture& picture : kPictures) {
    const PictureView view = picture.from_above ? topView(surfels, up, kPictureWidth, kPictureHeight)
                                                : orbitView(surfels, up, kPictureWidth, kPictureHeight);
    const bool legend = picture.colouring == Colouring::kContribution;
    auto image = renderPicture(*device, surfels, view, picture.colouring, legend ? robots : 0);
    if (!image) return image.error();
    const std::string path = folder + "/" + picture.name;
    if (auto written = writeColourPng(path, *image); !written) return written.error();
    auto bytes = readBytes(path);
    if (!bytes) return bytes.error();
    pictures.push_back({picture.title, std::move(*bytes)});
  }
  return pictures;
}

}  // namespace comap
