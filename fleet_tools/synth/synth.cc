#include "fleet_tools/synth/synth.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "edge_agent/capture/image_file.h"
#include "edge_agent/capture/stamp.h"
#include "fleet_tools/synth/synth_noise.h"
#include "fleet_tools/synth/synth_parallel.h"
#include "fleet_tools/synth/synth_path.h"
#include "fleet_tools/synth/synth_random.h"
#include "fleet_tools/synth/synth_renderer.h"
#include "fleet_tools/synth/synth_surface.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kReadmeStart = "Synthetic RGB-D sequences";
constexpr int kJpegQuality = 92;
constexpr int64_t kStart_ns = 1'000'000'000'000;
constexpr CameraModel kCamera{525, 525, 319.5, 239.5, 640, 480};

std::string robotName(int index) { return std::string(1, static_cast<char>('a' + index)); }

// Rounded to the microsecond, as the lists write it.
int64_t stampOf(int frame) { return kStart_ns + (int64_t{frame} * 1'000'000 + 15) / 30 * 1000; }

// What was written for one robot, and nothing that somebody put beside it.
void removeRecording(const fs::path& folder) {
  std::error_code problem;
  for (const auto& [pictures, extension] : {std::pair("rgb", ".jpg"), std::pair("depth", ".png")}) {
    std::vector<fs::path> written;
    for (const auto& entry : fs::directory_iterator(folder / pictures, problem))
      if (entry.path().extension() == extension) written.push_back(entry.path());
    for (const fs::path& picture : written) fs::remove(picture, problem);
    fs::remove(folder / pictures, problem);
  }
  for (const char* name : {"rgb.txt", "depth.txt", "associations.txt", "groundtruth.txt", "calibration.txt"})
    fs::remove(folder / name, problem);
  fs::remove(folder, problem);
}

Result<void> prepareFolder(const SynthOptions& options) {
  const fs::path out(options.out);
  std::error_code problem;
  if (fs::exists(out, problem) && !fs::is_directory(out, problem)) {
    return Error{ErrorCode::kWrongUse, options.out + ": is there and is not a folder"};
  }
  if (fs::exists(out, problem) && !fs::is_empty(out, problem)) {
    std::string first;
    std::getline(std::ifstream(out / "README.txt") >> std::ws, first);
    if (first.rfind(kReadmeStart, 0) != 0) {
      return Error{ErrorCode::kWrongUse,
                   options.out + ": is not empty and not an earlier synthetic data set; " + "choose another folder"};
    }
    for (char name = 'a'; name <= 'z'; ++name) removeRecording(out / std::string(1, name));
    fs::remove(out / "surface.ply", problem);
  }
  for (int robot = 0; robot < options.robots; ++robot) {
    for (const char* kind : {"rgb", "depth"}) {
      fs::create_directories(out / robotName(robot) / kind, problem);
      if (problem) return Error{ErrorCode::kUnreachable, options.out + ": cannot be created: " + problem.message()};
    }
  }
  return {};
}

Result<void> writeText(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) return Error{ErrorCode::kUnreachable, path.string() + ": cannot be written"};
  return {};
}

Result<void> writeLists(const fs::path& folder, const std::vector<Pose>& poses) {
  std::string rgb = "# timestamp filename\n", depth = rgb, associations;
  std::string truth = "# timestamp tx ty tz qx qy qz qw (camera to world)\n";
  for (size_t i = 0; i < poses.size(); ++i) {
    const std::string stamp = formatStamp(stampOf(static_cast<int>(i)));
    const std::string colour_line = stamp + " rgb/" + stamp + ".jpg", depth_line = stamp + " depth/" + stamp + ".png";
    rgb += colour_line + "\n";
    depth += depth_line + "\n";
    associations += colour_line + " " + depth_line + "\n";
    const auto& t = poses[i].translation();
    const auto& q = poses[i].rotation();
    char line[256];
    std::snprintf(line, sizeof line, "%s %.8f %.8f %.8f %.9f %.9f %.9f %.9f\n", stamp.c_str(), t.x(), t.y(), t.z(),
                  q.x(), q.y(), q.z(), q.w());
    truth += line;
  }
  const std::pair<const char*, std::string> files[] = {
      {"rgb.txt", rgb},
      {"depth.txt", depth},
      {"associations.txt", associations},
      {"groundtruth.txt", truth},
      {"calibration.txt", "# fx fy cx cy width height depth_scale\n525 525 319.5 239.5 640 480 5000\n"}};
  for (const auto& [name, text] : files) {
    if (auto written = writeText(folder / name, text); !written) return written;
  }
  return {};
}

Result<void> writeFrame(const fs::path& folder, int frame, SynthView& view, const SynthOptions& options, uint64_t key) {
  const std::string stamp = formatStamp(stampOf(frame));
  DepthImage depth =
      options.kinect_noise ? kinectDepth(view, mixBits(key, 1), options.threads) : exactDepth(view, options.threads);
  if (options.kinect_noise) addColourNoise(view.colour, mixBits(key, 2), options.threads);
  Result<void> written[2];
  parallelFor(2, options.threads, [&](int i) {
    written[i] = i == 0 ? writeDepth16Png((folder / "depth" / (stamp + ".png")).string(), depth)
                        : writeColourJpeg((folder / "rgb" / (stamp + ".jpg")).string(), view.colour, kJpegQuality);
  });
  return written[0] ? written[1] : written[0];
}

std::string readmeText(const SynthOptions& options, const Scene& scene, const SynthSummary& summary) {
  std::string about;
  for (const auto& info : knownScenes()) {
    if (info.name == scene.name) about = info.description;
  }
  return std::string(kReadmeStart) + " with exact truth, made by: fleet synth --scene " + options.scene + " --robots " +
         std::to_string(options.robots) + " --frames " + std::to_string(options.frames) + " --seed " +
         std::to_string(options.seed) + " --noise " + (options.kinect_noise ? "kinect" : "none") + "\n\nScene " +
         scene.name + ": " + about + ".\n\n" +
         "One folder per robot (a, b, ...) in the TUM RGB-D format: rgb/ (JPEG), depth/ (16-bit PNG, 5000 per metre,\n"
         "0 = none, z of the ray through the pixel's centre), rgb.txt, depth.txt, associations.txt, calibration.txt\n"
         "(fx fy cx cy width height depth_scale; pixel centres at integers), groundtruth.txt (timestamp tx ty tz qx "
         "qy\n"
         "qz qw, camera to world; camera x right, y down, z forward; world z up, common to all robots). 30 Hz; all\n"
         "robots start at the same time, at places unknown to each other.\n\n" +
         (options.kinect_noise
              ? "Depth is Kinect-like (lateral jitter 0.5 px, disparity steps with noise, 0.4 to 4.5 m, "
                "nothing at depth edges\nand beyond 82 degrees); colour noise 1.2 grey levels.\n\n"
              : "Depth is exact to its unit of 0.2 mm, colour is without noise.\n\n") +
         "surface.ply: " + std::to_string(summary.surface_points) +
         " exact surface points with normals that a robot saw within 4.5 m, one per 15 mm cube.\n"
         "Light does not depend on where one looks from.\n";
}

Result<void> checkOptions(const SynthOptions& options, const Scene& scene) {
  const int most = static_cast<int>(scene.routes.size());
  if (options.robots < 1 || options.robots > most) {
    return Error{ErrorCode::kWrongUse, "--robots " + std::to_string(options.robots) + ": scene " + scene.name +
                                           " has routes for 1 to " + std::to_string(most)};
  }
  if (options.frames < 1 || options.frames > 100000) {
    return Error{ErrorCode::kWrongUse, "--frames " + std::to_string(options.frames) + ": expected 1 to 100000"};
  }
  if (options.out.empty()) return Error{ErrorCode::kWrongUse, "--out: names no folder"};
  return {};
}

}  // namespace

Result<SynthSummary> synthesise(const SynthOptions& options, const std::function<void(size_t, size_t)>& progress) {
  const auto begin = std::chrono::steady_clock::now();
  auto scene = makeScene(options.scene, options.seed);
  if (!scene) return scene.error();
  if (auto checked = checkOptions(options, *scene); !checked) return checked.error();
  if (auto prepared = prepareFolder(options); !prepared) return prepared.error();

  const SynthRenderer renderer(*scene, options.threads);
  SurfaceCollector surface;
  SynthSummary summary;
  const size_t total = static_cast<size_t>(options.robots) * static_cast<size_t>(options.frames);
  for (int robot = 0; robot < options.robots; ++robot) {
    const fs::path folder = fs::path(options.out) / robotName(robot);
    const uint64_t robot_key = mixBits(options.seed, 1000 + static_cast<uint64_t>(robot));
    const auto poses = walkRoute(scene->routes[static_cast<size_t>(robot)], options.frames, robot_key);
    for (int frame = 0; frame < options.frames; ++frame) {
      const Pose& T_world_cam = poses[static_cast<size_t>(frame)];
      SynthView view = renderer.render(kCamera, T_world_cam);
      surface.add(view, kCamera, T_world_cam, renderer, frame);
      const uint64_t key = mixBits(robot_key, static_cast<uint64_t>(frame));
      if (auto written = writeFrame(folder, frame, view, options, key); !written) return written.error();
      progress(++summary.frames, total);
    }
    if (auto written = writeLists(folder, poses); !written) return written.error();
  }
  summary.surface_points = surface.points().positions.size();
  const fs::path out(options.out);
  auto written =
      writePlySurface((out / "surface.ply").string(), surface.points(), "exact surface points, one per 15 mm");
  if (!written) return written.error();
  written = writeText(out / "README.txt", readmeText(options, *scene, summary));
  if (!written) return written.error();
  summary.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return summary;
}

}  // namespace comap
