#include "fleet_tools/report/map_pictures.h"

#include <filesystem>
#include <fstream>

#include "edge_agent/capture/image_file.h"
#include "fleet_tools/render/surfel_renderer.h"
#include "protocol/types/whole_file.h"

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
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path, std::ios::binary);
  std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  return bytes;
}

}  // namespace

Result<void> paintMap(const std::string& folder, const std::string& device_choice,
                      const std::vector<std::string>& robots, const std::vector<Surfel>& surfels,
                      const std::vector<Pose>& T_map_cams) {
  gpu::DeviceOptions device_options;
  device_options.choice = device_choice;
  device_options.cache_directory = gpu::defaultCacheDirectory();
  auto device = gpu::Device::create(device_options);
  if (!device) return device.error();
  const Eigen::Vector3d up = upDirection(surfels, T_map_cams);
  for (const Picture& picture : kPictures) {
    const PictureView view = picture.from_above ? topView(surfels, up, kPictureWidth, kPictureHeight)
                                                : orbitView(surfels, up, kPictureWidth, kPictureHeight);
    auto image = renderPicture(*device, surfels, view, picture.colouring, legendOf(picture.colouring, robots));
    if (!image) return image.error();
    if (auto written = writeColourPng(folder + "/" + picture.name, *image); !written) return written.error();
  }
  return {};
}

Result<std::vector<ReportPicture>> readMapPictures(const std::string& folder) {
  std::vector<ReportPicture> pictures;
  for (const Picture& picture : kPictures) {
    const std::string path = folder + "/" + picture.name;
    std::error_code problem;
    if (!std::filesystem::exists(path, problem)) continue;
    auto bytes = readBytes(path);
    if (!bytes) return bytes.error();
    pictures.push_back({picture.title, std::move(*bytes), picture.colouring == Colouring::kContribution});
  }
  return pictures;
}

}  // namespace comap
