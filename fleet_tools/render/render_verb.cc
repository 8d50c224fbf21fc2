#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <sstream>

#include "edge_agent/capture/image_file.h"
#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/output_file.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/render/robot_order.h"
#include "fleet_tools/render/surfel_renderer.h"
#include "fleet_tools/store/record_json.h"
#include "mapping_core/store/map_store.h"
#include "mapping_core/tiles/tile_builder.h"

namespace comap {
namespace {

struct RenderOptions {
  std::string store, out, map;
  std::string view = "orbit", size = "1600x1000", device = "auto";
  std::string colour = "rgb";
  bool json = false;
};

Colouring colouringOf(const std::string& name) {
  if (name == "normal") return Colouring::kNormal;
  if (name == "contribution") return Colouring::kContribution;
  return name == "confidence" ? Colouring::kConfidence : Colouring::kRgb;
}

struct Size {
  int width = 0, height = 0;
};

Result<Size> parseSize(const std::string& text) {
  Size size;
  char rest = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%c", &size.width, &size.height, &rest) == 2 && size.width >= 16 &&
      size.height >= 16 && size.width <= 8192 && size.height <= 8192 && size.width * size.height <= 1 << 23) {
    return size;
  }
  return Error{ErrorCode::kWrongUse,
               "--size is '" + text + "', expected WIDTHxHEIGHT, each from 16 to 8192, at most 8388608 pixels"};
}

Result<Pose> parsePose(const std::string& text) {
  std::istringstream in(text);
  std::array<double, 7> v{};
  for (double& value : v) in >> value;
  std::string rest;
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  if (in && !(in >> rest) && rotation.norm() > 1e-6 && rotation.coeffs().allFinite()) {
    return Pose(rotation, Eigen::Vector3d(v[0], v[1], v[2]));
  }
  return Error{ErrorCode::kWrongUse, "--view is 'pose " + text + "', expected 'pose tx ty tz qx qy qz qw'"};
}

// Another program would take the name's word for what is in the file.
Result<void> checkEnding(const std::string& path) {
  std::string ending = std::filesystem::path(path).extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (ending == ".png") return {};
  return Error{ErrorCode::kWrongUse, "--out " + path + ": a PNG file is written, expected a name that ends in .png"};
}

// The map meant: that named, or the largest.
Result<MapId> chooseMap(const MapStore& store, const RenderOptions& options) {
  const auto sizes = store.mapSizes();
  if (!sizes) return sizes.error();
  const auto hasSurfels = [](const auto& map) { return map.second.surfels > 0; };
  if (std::none_of(sizes->begin(), sizes->end(), hasSurfels))
    return Error{ErrorCode::kProblem, options.store + ": holds no map with surfels yet"};
  if (!options.map.empty() && !sizes->contains(options.map)) {
    std::vector<std::string> maps;
    for (const auto& [map, size] : *sizes) maps.push_back(map);
    return Error{ErrorCode::kWrongUse,
                 options.store + ": holds no map '" + printable(options.map) + "', but " + listed(maps)};
  }
  MapId largest = options.map;
  size_t most = 0;
  for (const auto& [map, size] : *sizes) {
    if (options.map.empty() && size.surfels > most) {
      most = size.surfels;
      largest = map;
    }
  }
  return largest;
}

Result<std::vector<Surfel>> loadSurfels(const MapStore& store, const RenderOptions& options, const MapId& map) {
  const auto tiles = store.tiles(map);
  if (!tiles) return tiles.error();
  std::vector<Surfel> surfels;
  for (const Tile& tile : *tiles) {
    for (const TileSurfel& packed : tile.surfels) surfels.push_back(dequantise(packed, tile.key));
  }
  if (surfels.empty())
    return Error{ErrorCode::kProblem, options.store + ": map " + printable(map) + " holds no surfels"};
  return surfels;
}

Result<PictureView> chooseView(const RenderOptions& options, std::span<const StoredKeyframe> keyframes,
                               std::span<const Surfel> surfels, Size size) {
  const auto after = [&](const char* prefix) { return options.view.substr(std::string(prefix).size()); };
  if (options.view.starts_with("pose ")) {
    const auto pose = parsePose(after("pose "));
    if (!pose) return pose.error();
    return cameraView(*pose, size.width, size.height);
  }
  if (options.view.starts_with("robot:")) {
    const StoredKeyframe* last = nullptr;
    for (const StoredKeyframe& keyframe : keyframes) {
      if (keyframe.id.robot == after("robot:") && (!last || keyframe.arrival > last->arrival)) last = &keyframe;
    }
    if (last) return cameraView(last->T_map_cam, size.width, size.height);
    std::set<std::string> robots;
    for (const StoredKeyframe& keyframe : keyframes) robots.insert(keyframe.id.robot);
    return Error{ErrorCode::kWrongUse, options.store + ": the map holds no keyframe of robot '" +
                                           printable(after("robot:")) + "', but of " +
                                           listed({robots.begin(), robots.end()})};
  }
  std::vector<Pose> poses;
  for (const StoredKeyframe& keyframe : keyframes) poses.push_back(keyframe.T_map_cam);
  const Eigen::Vector3d up = upDirection(surfels, poses);
  if (options.view == "orbit") return orbitView(surfels, up, size.width, size.height);
  if (options.view == "top") return topView(surfels, up, size.width, size.height);
  return Error{ErrorCode::kWrongUse,
               "--view is '" + options.view + "', expected orbit, top, robot:NAME or 'pose tx ty tz qx qy qz qw'"};
}

int run(const RenderOptions& options) {
  if (const auto free = checkOutputFile(options.out); !free) return failWith(free.error());
  if (auto named = checkEnding(options.out); !named) return failWith(named.error());
  const auto size = parseSize(options.size);
  if (!size) return failWith(size.error());
  const auto store = MapStore::open(options.store, MapStore::Mode::kReadOnly);
  if (!store) return failWithStore(store.error(), options.store);
  const auto map = chooseMap(*store, options);
  if (!map) return failWith(map.error());
  auto surfels = loadSurfels(*store, options, *map);
  if (!surfels) return failWith(surfels.error());
  auto keyframes = store->keyframes();
  if (!keyframes) return failWith(keyframes.error());
  std::erase_if(*keyframes, [&](const StoredKeyframe& keyframe) { return keyframe.map != *map; });
  const auto robots = store->robots();
  if (!robots) return failWith(robots.error());
  const auto view = chooseView(options, *keyframes, *surfels, *size);
  if (!view) return failWith(view.error());

  gpu::DeviceOptions device_options;
  device_options.choice = options.device;
  device_options.cache_directory = gpu::defaultCacheDirectory();
  auto device = gpu::Device::create(device_options);
  if (!device) return failWith(device.error());
  const Colouring colouring = colouringOf(options.colour);
  const auto legend = legendOf(colouring, orderContributors(*robots, *surfels));
  const auto picture = renderPicture(*device, *surfels, *view, colouring, legend);
  if (!picture && picture.error().code == ErrorCode::kProblem)
    return failWith({ErrorCode::kProblem, options.store + ": --view '" + printable(options.view) + "', map " +
                                              printable(*map) + ": " + picture.error().text +
                                              "; no picture is written"});
  if (!picture) return failWith(picture.error());
  if (const auto written = writeColourPng(options.out, *picture); !written) return failWith(written.error());

  if (options.json) {
    printJson({{"file", options.out}, {"map", *map}, {"surfels", surfels->size()}, {"device", device->info().name}});
    return 0;
  }
  std::printf("%s\nmap %s, %zu surfels\n", options.out.c_str(), printable(*map).c_str(), surfels->size());
  for (size_t i = 0; i < legend.size(); ++i) {
    const Rgb c = legend[i].colour;
    std::printf("colour %zu, #%02x%02x%02x: %s\n", i + 1, c.r, c.g, c.b, printable(legend[i].name).c_str());
  }
  return 0;
}

}  // namespace

void addRenderVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("render", "A picture of a map");
  verb->footer(
      "orbit: the whole map from outside and above, without the walls and ceilings that are in the way. top: a plan.\n"
      "robot:NAME: what that robot's last keyframe looked at. contribution: a colour per robot, mixed where several\n"
      "saw the surface. normal: a colour per direction of the map's axes. confidence: how often a surface was "
      "measured.\n"
      "At the foot stands which colour is what; robots have theirs by the order of their names.\n"
      "Example: fleet render run/map.comap --out map.png --colour contribution");
  auto options = std::make_shared<RenderOptions>();
  verb->add_option("STORE", options->store, "Map store to read")->required();
  verb->add_option("--out", options->out, "PNG file to write; one that is there is replaced")->required();
  verb->add_option("--view", options->view, "orbit, top, robot:NAME or 'pose tx ty tz qx qy qz qw'")
      ->capture_default_str();
  verb->add_option("--colour", options->colour, "What the colours are")
      ->check(CLI::IsMember({"rgb", "normal", "contribution", "confidence"}))
      ->capture_default_str();
  verb->add_option("--map", options->map, "Which map; the largest if left out");
  verb->add_option("--size", options->size, "WIDTHxHEIGHT in pixels, each from 16 to 8192, at most 8388608 in all")
      ->capture_default_str();
  verb->add_option("--device", options->device,
                   "Vulkan device: auto, llvmpipe or a number of mapping_core --list-devices")
      ->capture_default_str();
  verb->add_flag("--json", options->json, "Print what was written as one JSON document");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
