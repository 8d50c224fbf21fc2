#include "edge_agent/capture/camera_config.h"

#include <spdlog/fmt/fmt.h>

#include "edge_agent/capture/image_file.h"
#include "protocol/config/yaml_text.h"

namespace comap {
namespace {

constexpr double kMostFocal_px = 20000;
constexpr double kWidest = 0.1;  // focal length over the picture's width: 157 degrees

// Size first: what a profile says of the lens is for a size.
void readLens(ConfigReader& reader, Lens& lens) {
  CameraModel& pinhole = lens.pinhole;
  int width = pinhole.width, height = pinhole.height;
  reader.read("width", width, 16, kMaxImageEdge_px);
  reader.read("height", height, 16, kMaxImageEdge_px);
  if (width != pinhole.width || height != pinhole.height) {
    const auto same_view = resized(lens, width, height);
    if (same_view) {
      lens = *same_view;
    } else if (pinhole.fx > 0 && !reader.has("fx")) {
      reader.complain("width", fmt::format("{}x{} has other proportions than the profile's {}x{}: give fx, fy, cx, cy",
                                           width, height, pinhole.width, pinhole.height));
    }
    pinhole.width = width;
    pinhole.height = height;
  }
  reader.read("fx", pinhole.fx, 0, kMostFocal_px);
  reader.read("fy", pinhole.fy, 0, kMostFocal_px);
  for (const auto& [key, focal] : {std::pair{"fx", pinhole.fx}, std::pair{"fy", pinhole.fy}})
    if (focal > 0 && focal < kWidest * pinhole.width)
      reader.complain(key, fmt::format("is {}, expected 0 (not known) or at least {} pixels for pictures {} wide",
                                       focal, kWidest * pinhole.width, pinhole.width));
  if ((pinhole.fx > 0) != (pinhole.fy > 0))
    reader.complain(pinhole.fx > 0 ? "fy" : "fx", pinhole.fx > 0 ? "is not given, but fx is: give both or none"
                                                                 : "is not given, but fy is: give both or none");
  // Where the axis meets the picture: one cut out of a larger picture may lie beside it, but not far.
  reader.read("cx", pinhole.cx, -pinhole.width, 2 * pinhole.width);
  reader.read("cy", pinhole.cy, -pinhole.height, 2 * pinhole.height);
  reader.read("k1", lens.k1, -10, 10);
  reader.read("k2", lens.k2, -10, 10);
  reader.read("p1", lens.p1, -1, 1);
  reader.read("p2", lens.p2, -1, 1);
  reader.read("k3", lens.k3, -10, 10);
}

void readControls(ConfigReader& reader, VideoControls& controls) {
  reader.read("exposure_us", controls.exposure_us, -1, 10'000'000);
  reader.read("gain", controls.gain, -1, 1'000'000);
}

std::string printEye(const char* name, const std::string& formats, const std::string& format, const Lens& lens,
                     const VideoControls& controls) {
  const CameraModel& p = lens.pinhole;
  return fmt::format(R"(  {}:
    format: {}                # auto, {}
    width: {}
    height: {}
    fx: {}                       # pixels at that size; 0: not known
    fy: {}
    cx: {}                       # pixel centres at whole numbers
    cy: {}
    k1: {}                       # Brown-Conrady, as OpenCV's k1 k2 p1 p2 k3
    k2: {}
    p1: {}
    p2: {}
    k3: {}
    exposure_us: {}             # -1: left as it is; 0: automatic
    gain: {}                    # -1: left as it is
)",
                     name, format, formats, p.width, p.height, p.fx, p.fy, p.cx, p.cy, lens.k1, lens.k2, lens.p1,
                     lens.p2, lens.k3, controls.exposure_us, controls.gain);
}

}  // namespace

CameraConfig::CameraConfig() { rig.colour.pinhole = rig.depth.pinhole = {0, 0, 319.5, 239.5, 640, 480}; }

const CameraProfile* CameraConfig::builtIn() const {
  for (const CameraProfile& known : cameraProfiles())
    if (known.name == profile) return &known;
  return nullptr;
}

void readCameraConfig(ConfigReader reader, CameraConfig& config) {
  std::vector<std::string> profiles{"none"};
  for (const CameraProfile& known : cameraProfiles()) profiles.push_back(known.name);
  reader.read("profile", config.profile, profiles);
  if (const CameraProfile* known = config.builtIn()) config.rig = known->rig;
  reader.read("registration", config.registration, {"auto", "device", "software"});
  reader.read("fps", config.fps, 1, 300);
  reader.read("shrink", config.shrink, 1, 4);
  if (config.shrink == 3) reader.complain("shrink", "is 3, expected 1, 2 or 4");
  reader.read("pair_gap_ms", config.pair_gap_ms, 1, 1000);
  reader.read("hot_celsius", config.hot_celsius, 0, 150);
  reader.read("thermal_folder", config.thermal_folder);
  reader.read("depth_units_per_m", config.rig.depth_units_per_m, 1, 1'000'000);

  ConfigReader colour = reader.section("colour");
  colour.read("format", config.colour_format, {"auto", "YUYV", "NV12", "RGB3", "BGR3", "MJPG"});
  readLens(colour, config.rig.colour);
  readControls(colour, config.colour_controls);

  ConfigReader depth = reader.section("depth");
  depth.read("format", config.depth_format, {"auto", "Z16", "INZI", "Y16"});
  readLens(depth, config.rig.depth);
  readControls(depth, config.depth_controls);

  ConfigReader place = reader.section("depth_in_colour");
  Vector6d twist;
  twist << config.rig.T_colour_depth.translation(), config.rig.T_colour_depth.log().tail<3>();
  const char* const names[] = {"x_m", "y_m", "z_m", "rx_rad", "ry_rad", "rz_rad"};
  for (int i = 0; i < 6; ++i) place.read(names[i], twist[i], i < 3 ? -1 : -3.2, i < 3 ? 1 : 3.2);
  Vector6d turn = Vector6d::Zero();
  turn.tail<3>() = twist.tail<3>();
  config.rig.T_colour_depth = Pose(Pose::exp(turn).rotation(), twist.head<3>());
}

std::string printCameraConfig(const CameraConfig& config) {
  std::string profiles = "none";
  for (const CameraProfile& known : cameraProfiles()) profiles += ", " + known.name;
  const Eigen::Vector3d& t = config.rig.T_colour_depth.translation();
  const Eigen::Vector3d r = config.rig.T_colour_depth.log().tail<3>();
  return fmt::format(R"(camera:                         # live cameras; recordings bring their own
  profile: {}                 # start values of a kind of camera: {}
  registration: {}            # auto: by the device if it can; device: depth comes registered; software
  fps: {}
  shrink: {}                     # frames so many times smaller than colour pictures: 1, 2 or 4
  pair_gap_ms: {}               # between the colour and the depth picture of a frame
  hot_celsius: {}               # a machine this hot takes fewer frames; 0: however hot it is
  thermal_folder: {}   # where the kernel tells temperatures
  depth_units_per_m: {}       # depth values to the metre
)",
                     config.profile, profiles, config.registration, config.fps, config.shrink, config.pair_gap_ms,
                     config.hot_celsius, yamlText(config.thermal_folder), config.rig.depth_units_per_m) +
         printEye("colour", "YUYV, NV12, RGB3, BGR3 or MJPG", config.colour_format, config.rig.colour,
                  config.colour_controls) +
         printEye("depth", "Z16, INZI or Y16", config.depth_format, config.rig.depth, config.depth_controls) +
         fmt::format(
             R"(  depth_in_colour:              # pose of the depth camera in the colour camera's frame (x right, y down, z ahead)
    x_m: {}
    y_m: {}
    z_m: {}
    rx_rad: {}                   # rotation vector
    ry_rad: {}
    rz_rad: {}
)",
             t.x(), t.y(), t.z(), r.x(), r.y(), r.z());
}

}  // namespace comap
