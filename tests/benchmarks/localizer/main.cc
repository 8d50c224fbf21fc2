// What the returned map is worth on the robot: drift with and without tiles, and finding oneself in what others have
// mapped.
#include <spdlog/fmt/fmt.h>

#include <CLI/CLI.hpp>
#include <iostream>

#include "tests/benchmarks/localizer/drift.h"
#include "tests/benchmarks/localizer/kidnap.h"

namespace comap {
namespace {

int fail(const Error& error) {
  std::cerr << error.text << '\n';
  return error.code == ErrorCode::kProblem ? 1 : error.code == ErrorCode::kWrongUse ? 2 : 3;
}

void row(const char* name, const DriftErrors& e) {
  fmt::print("  {:<24} {:>8.4f} {:>8.4f} {:>8.4f} {:>8.4f} {:>8.2f}\n", name, e.end_m, e.rms_m, e.median_m, e.worst_m,
             e.end_deg);
}

void print(const DriftOptions& options, const DriftOutcome& o) {
  fmt::print("{} in the map of {}, {} frames", options.robot, fmt::join(options.mappers, ", "), o.frames);
  fmt::print("; the core answers every {} frames", options.answer_every);
  if (options.silent_after > 0)
    fmt::print(" and no more {} frames after it has joined the robot", options.silent_after);
  fmt::print("\n  {:<24} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "metres", "end", "rms", "median", "worst", "end deg");
  row("with tiles", o.with_tiles);
  row("with tiles, smooth", o.smooth);
  row("corrections alone", o.without_tiles);
  row("odometry alone", o.odometry);
  fmt::print("  {} registrations, {} refused; corrected by {:.4f} m on average, {:.4f} m at most\n", o.registered,
             o.refused, o.corrected_m_mean, o.corrected_m_worst);
  fmt::print("  one takes {:.1f} ms (median), {:.1f} (95 %), {:.1f} (worst)\n", o.registration_ms_median,
             o.registration_ms_p95, o.registration_ms_worst);
}

void print(const KidnapOptions& options, const KidnapOutcome& o) {
  fmt::print("{} -> {} in the map of {}: ", options.own, options.away, fmt::join(options.mappers, ", "));
  if (o.recognised_after < 0) {
    fmt::print("not recognised in {} frames", o.frames);
  } else {
    fmt::print("recognised after {} frames: right in {}, wrong in {}; placed: right in {}, wrong in {}",
               o.recognised_after, o.hypothesis_right, o.hypothesis_wrong, o.right, o.wrong);
    if (o.right + o.hypothesis_right > 0) fmt::print(" (median error of the right ones {:.4f} m)", o.error_m);
  }
  if (o.found_back_after >= 0) fmt::print(", seen in its own memory after {}", o.found_back_after);
  if (o.taken_back > 0) fmt::print(", taken back {} times", o.taken_back);
  if (o.joined_after < 0)
    fmt::print("; not joined by the core");
  else
    fmt::print("; joined by the core after {} frames", o.joined_after);
  fmt::print("; slowest frame {:.0f} ms\n", o.search_ms_worst);
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  using namespace comap;
  CLI::App app("Drift with and without the map's tiles, and finding oneself in them.");
  app.require_subcommand(1);
  std::string device_choice = "auto";
  app.add_option("--device", device_choice, "Vulkan device of the core");
  DriftOptions drift;
  CLI::App* drift_verb = app.add_subcommand("drift", "a robot walks through what others have mapped before");
  drift_verb->add_option("--mapper", drift.mappers, "DIR[@FIRST:LAST], one or more")->required();
  drift_verb->add_option("--robot", drift.robot, "DIR[@FIRST:LAST]")->required();
  drift_verb->add_option("--every", drift.every, "play only every so many-th frame of the robot")
      ->check(CLI::Range(1, 100));
  drift_verb->add_option("--answer-every", drift.answer_every, "frames between the core's answers");
  drift_verb->add_option("--silent-after", drift.silent_after,
                         "frames in the map after which the core is heard no more; errors count from there");
  drift_verb->add_flag("-v,--verbose", drift.verbose);
  KidnapOptions kidnap;
  CLI::App* kidnap_verb = app.add_subcommand("kidnap", "a robot is covered and carried off");
  kidnap_verb->add_option("--mapper", kidnap.mappers, "DIR[@FIRST:LAST], one or more")->required();
  kidnap_verb->add_option("--own", kidnap.own, "DIR[@FIRST:LAST], what it sees before")->required();
  std::vector<std::string> aways;
  kidnap_verb->add_option("--away", aways, "DIR[@FIRST:LAST], what it sees after; one run each")->required();
  kidnap_verb->add_option("--covered", kidnap.covered, "black frames in between");
  kidnap_verb->add_flag("-v,--verbose", kidnap.verbose);
  CLI11_PARSE(app, argc, argv);

  gpu::DeviceOptions options;
  options.choice = device_choice;
  auto device = gpu::Device::create(options);
  if (!device) return fail(device.error());
  if (drift_verb->parsed()) {
    const auto outcome = measureDrift(*device, drift);
    if (!outcome) return fail(outcome.error());
    print(drift, *outcome);
    return 0;
  }
  int wrong = 0;
  for (const std::string& away : aways) {
    kidnap.away = away;
    const auto outcome = measureKidnap(*device, kidnap);
    if (!outcome) return fail(outcome.error());
    print(kidnap, *outcome);
    wrong += outcome->wrong;
  }
  return wrong > 0 ? 1 : 0;
}
