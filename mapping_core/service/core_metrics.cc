#include "mapping_core/service/core_metrics.h"

#include <spdlog/fmt/fmt.h>

namespace comap {
namespace {

constexpr double kGone_s = 10;  // robots speak at least once a second

void addRobots(const ServiceState& state, MetricsPage& page) {
  for (const auto& [robot, one] : state.robots) {
    const MetricsPage::Labels labels{{"robot", robot}};
    if (one.silent_s && !one.finished)
      page.gauge(
          "comap_core_robot_silent_seconds",
          "Since a robot that has not ended was last heard of; of one that only an earlier core has heard, since "
          "this one's start.",
          *one.silent_s, labels);
    page.gauge("comap_core_robot_refused",
               "1 if a robot is not served, or in the last five minutes a second one of its name was not.",
               one.refused ? 1 : 0, labels);
  }
}

}  // namespace

Telemetry::Report reportOf(const MappingService& service, const std::string& device, bool ready) {
  const ServiceStatistics& statistics = service.statistics();
  const ServiceState state = service.state();
  Telemetry::Report report;
  MetricsPage& page = report.metrics;
  page.gauge("comap_core_info", "Version and device; always 1.", 1, {{"version", COMAP_VERSION}, {"device", device}});
  page.gauge("comap_core_keyframes", "Keyframes in the maps.", state.keyframes);
  page.gauge("comap_core_keyframes_waiting", "Keyframes stored and not yet mapped.", state.waiting);
  page.gauge("comap_core_keyframes_unfused", "Keyframes mapped whose surfels are to be fused anew.", state.unfused);
  page.summary("comap_core_keyframe_seconds", "From taking a keyframe up to its acknowledgement as mapped.",
               statistics.keyframe_ms);
  page.gauge("comap_core_load_ratio",
             "Share of the core's time that what arrived in the last minute needs; above 1 it falls behind.",
             state.load.load());
  for (const auto& [robot, bytes] : statistics.uplink_bytes)
    page.counter("comap_core_uplink_bytes_total", "Keyframes as they arrived.", static_cast<double>(bytes),
                 {{"robot", robot}});
  for (const auto& [robot, bytes] : service.tileBytes())
    page.counter("comap_core_tile_bytes_total", "Tiles sent.", static_cast<double>(bytes), {{"robot", robot}});
  page.counter("comap_core_refused_messages_total", "Messages damaged or unexpected.",
               static_cast<double>(statistics.refused_messages));
  for (const auto& [reason, count] : statistics.verdicts)
    page.counter("comap_core_matches_total", "Place matches judged, by what became of them.",
                 static_cast<double>(count), {{"reason", reason}});
  page.counter("comap_core_merges_total", "Merges of maps.", static_cast<double>(statistics.merges));
  page.counter("comap_core_merges_undone_total", "Merges that were taken back.",
               static_cast<double>(statistics.merges_undone));
  page.gauge("comap_core_merges_on_probation", "Merges that later keyframes have yet to confirm.", state.on_probation);
  page.gauge("comap_core_store_failing", "1 if the store takes no keyframes, as when its disk is full.",
             state.store_failure.empty() ? 0 : 1);
  page.gauge("comap_core_maps", "Maps.", static_cast<double>(state.surfels.size()));
  for (const auto& [map, surfels] : state.surfels)
    page.gauge("comap_core_surfels", "Surfels of a map.", static_cast<double>(surfels), {{"map", map}});
  page.gauge("comap_core_surfel_memory_bytes", "Device memory that surfels take.",
             static_cast<double>(state.surfel_bytes));
  addRobots(state, page);

  size_t present = 0;
  for (const auto& [robot, one] : state.robots) present += one.served && *one.silent_s < kGone_s;
  page.gauge("comap_core_robots", "Robots heard in the last 10 s.", static_cast<double>(present));
  report.readiness.ready = ready && state.store_failure.empty();
  report.readiness.state =
      fmt::format("{}{}{} robots, {} keyframes in {} maps, {} wait", ready ? "" : "finishing: ",
                  state.store_failure.empty() ? "" : "the store takes no keyframes: " + state.store_failure + "; ",
                  present, state.keyframes, state.surfels.size(), state.waiting + state.unfused);
  return report;
}

}  // namespace comap
