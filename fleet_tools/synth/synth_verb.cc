#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <thread>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/synth/scene.h"
#include "fleet_tools/synth/synth.h"

namespace comap {
namespace {

int listScenes() {
  for (const auto& info : knownScenes()) {
    const auto scene = makeScene(info.name, 1);
    if (!scene) return failWith(scene.error());
    std::printf("%-10s up to %zu robots: %s\n", info.name, scene->routes.size(), info.description);
  }
  return 0;
}

std::vector<std::string> sceneNames() {
  std::vector<std::string> names;
  for (const auto& info : knownScenes()) names.emplace_back(info.name);
  return names;
}

int run(const SynthOptions& options) {
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto progress = [&](size_t done, size_t total) {
    if (terminal) std::fprintf(stderr, "\rframe %zu of %zu%s", done, total, done == total ? "\n" : "");
  };
  auto summary = synthesise(options, progress);
  if (!summary) return failWith(summary.error());
  std::printf("%s: scene %s, %d robots x %d frames, %zu surface points, %.1f s\n", options.out.c_str(),
              options.scene.c_str(), options.robots, options.frames, summary->surface_points, summary->wall_s);
  return 0;
}

}  // namespace

void addSynthVerb(CLI::App& app, int& exit_code) {
  auto* verb =
      app.add_subcommand("synth", "Make a data set of several robots from an analytic scene, with exact truth");
  verb->footer("Example: fleet synth --scene flat --robots 2 --frames 200 --seed 1 --noise kinect --out data/flat");
  auto options = std::make_shared<SynthOptions>();
  options->threads = static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1u, 64u));
  auto noise = std::make_shared<std::string>("kinect");
  auto list = std::make_shared<bool>(false);
  verb->add_option("--scene", options->scene, "Which scene, see --list-scenes")
      ->check(CLI::IsMember(sceneNames()))
      ->capture_default_str();
  verb->add_option("--robots", options->robots, "Number of robots: a, b, c, ...; as many as the scene has routes for")
      ->capture_default_str();
  verb->add_option("--frames", options->frames, "Frames of each robot, 30 a second; 1 to 100000")
      ->capture_default_str();
  verb->add_option("--seed", options->seed, "Same seed, same bytes")->capture_default_str();
  verb->add_option("--noise", *noise, "Depth and colour noise")
      ->check(CLI::IsMember({"none", "kinect"}))
      ->capture_default_str();
  verb->add_option(
      "--out", options->out,
      "Folder to write, needed but for --list-scenes; must be new, empty or an earlier synthetic data set");
  verb->add_option("--threads", options->threads, "Threads to use; changes nothing in the result")
      ->check(CLI::Range(1, 256))
      ->capture_default_str();
  verb->add_flag("--list-scenes", *list, "Print the scenes and stop");
  verb->callback([options, noise, list, &exit_code] {
    if (*list) {
      exit_code = listScenes();
      return;
    }
    if (options->out.empty()) {
      exit_code = failWith({ErrorCode::kWrongUse, "--out is required: the folder to write"});
      return;
    }
    options->kinect_noise = *noise == "kinect";
    exit_code = run(*options);
  });
}

}  // namespace comap
