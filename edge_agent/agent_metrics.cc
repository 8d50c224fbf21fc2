#include "edge_agent/agent_metrics.h"

#include <spdlog/fmt/fmt.h>

namespace comap {

const char* trackingName(TrackingState state) {
  switch (state) {
    case TrackingState::kOk:
      return "ok";
    case TrackingState::kPoor:
      return "poor";
    default:
      return "lost";
  }
}

namespace {

void addCounts(const Agent& agent, const MetricsPage::Labels& robot, MetricsPage& page) {
  const AgentStatistics& s = agent.statistics();
  const auto count = [&](const char* name, const char* help, uint64_t value) {
    page.counter(name, help, static_cast<double>(value), robot);
  };
  count("comap_agent_frames_total", "Frames taken.", s.frames);
  count("comap_agent_poor_frames_total", "Frames whose motion is not known in all directions.", s.poor_frames);
  count("comap_agent_lost_frames_total", "Frames whose motion is not known.", s.lost_frames);
  count("comap_agent_damaged_frames_total", "Frames that could not be read.", s.damaged_frames);
  count("comap_agent_keyframes_total", "Keyframes made.", s.keyframes);
  count("comap_agent_keyframes_thinned_total", "Keyframes sent with coarser colour for want of room.",
        agent.losses().thinned);
  count("comap_agent_keyframes_dropped_total", "Keyframes dropped for want of room.", agent.losses().dropped);
  count("comap_agent_keyframes_damaged_total", "Keyframes lost with a damaged outbox.", agent.losses().damaged);
  count("comap_agent_relocalised_total", "Times a lost robot found back to a known place.", s.relocalised);
  count("comap_agent_recognised_total", "Times a lost robot found itself in the returned map.",
        agent.localizer().statistics().recognised);
  count("comap_agent_uplink_bytes_total", "Keyframes sent, repeats included.", agent.uplinkBytes());
  count("comap_agent_tile_bytes_total", "Tiles received.", s.tile_bytes_received);
}

void addLevels(const Agent& agent, const MetricsPage::Labels& robot, MetricsPage& page) {
  const auto level = [&](const char* name, const char* help, double value) { page.gauge(name, help, value, robot); };
  level("comap_agent_outbox_keyframes", "Keyframes that the core has not acknowledged.", agent.unacknowledged());
  level("comap_agent_outbox_bytes", "Their size.", static_cast<double>(agent.waitingBytes()));
  level("comap_agent_outbox_memory_keyframes", "Those of them that only memory holds, as the disk failed.",
        agent.onlyInMemory());
  level("comap_agent_outbox_refused_keyframes", "Those of them that the core cannot take.",
        static_cast<double>(agent.refusedKeyframes().size()));
  level("comap_agent_outbox_stalled_seconds", "How long keyframes have waited without any being acknowledged.",
        agent.stalled().count());
  level("comap_agent_core_present", "1 if a mapping core is in sight.", agent.hasPeer() ? 1 : 0);
  level("comap_agent_tiles", "Tiles held.", static_cast<double>(agent.tiles().tiles().size()));
  level("comap_agent_tile_memory_bytes", "Memory that they take.", static_cast<double>(agent.tiles().bytes()));
  for (const TrackingState state : {TrackingState::kOk, TrackingState::kPoor, TrackingState::kLost}) {
    MetricsPage::Labels labels = robot;
    labels["state"] = trackingName(state);
    page.gauge("comap_agent_tracking", "1 for the state that tracking is in.", agent.tracking() == state ? 1 : 0,
               labels);
  }
}

MetricsPage::Labels with(MetricsPage::Labels labels, const std::string& name, const std::string& value) {
  labels[name] = value;
  return labels;
}

void addStream(const StreamHealth& stream, const MetricsPage::Labels& labels, MetricsPage& page) {
  const auto count = [&](const char* name, const char* help, uint64_t value) {
    page.counter(name, help, static_cast<double>(value), labels);
  };
  count("comap_agent_camera_pictures_total", "Pictures of a stream that came whole.", stream.taken);
  for (const auto& [reason, value] : {std::pair{"damaged", stream.damaged}, std::pair{"missed", stream.missed},
                                      std::pair{"repeated", stream.repeated}})
    page.counter("comap_agent_camera_pictures_lost_total",
                 "Pictures of a stream that came damaged, that the device counted and never came, that came again.",
                 static_cast<double>(value), with(labels, "reason", reason));
  count("comap_agent_camera_clock_jumps_total", "Pictures whose stamp cannot be: the time of arrival was taken.",
        stream.clock_jumps);
  count("comap_agent_camera_stalls_total", "Times an open stream gave nothing new for a second.", stream.stalls);
  count("comap_agent_camera_reopened_total", "Times the device was opened again.", stream.reopened);
  for (const StreamState state :
       {StreamState::kStarting, StreamState::kStreaming, StreamState::kStalled, StreamState::kGone})
    page.gauge("comap_agent_camera_stream", "1 for the state that the stream is in.", stream.state == state ? 1 : 0,
               with(labels, "state", toString(state)));
}

}  // namespace

void addCamera(const CaptureHealth& camera, const MetricsPage::Labels& robot, MetricsPage& page) {
  addStream(camera.colour, with(robot, "stream", "colour"), page);
  addStream(camera.depth, with(robot, "stream", "depth"), page);
  for (const auto& [reason, value] : {std::pair{"overtaken", camera.overtaken}, std::pair{"unpaired", camera.unpaired},
                                      std::pair{"not_decoded", camera.not_decoded}})
    page.counter("comap_agent_camera_frames_left_out_total",
                 "Frames not taken: a newer one was there, depth was missing, a picture could not be decoded.",
                 static_cast<double>(value), with(robot, "reason", reason));
  page.gauge("comap_agent_camera_one_of", "Of so many frames one is taken, for want of time or for heat.", camera.every,
             robot);
  if (camera.hottest_C)
    page.gauge("comap_agent_camera_machine_celsius", "The hottest place of the machine.", *camera.hottest_C, robot);
}

std::string cameraTrouble(const std::optional<CaptureHealth>& camera) {
  const auto gives = [](StreamState state) {
    return state == StreamState::kStreaming || state == StreamState::kStarting;
  };
  std::string trouble;
  if (!camera) return trouble;
  if (!gives(camera->colour.state)) trouble = "colour " + toString(camera->colour.state);
  if (!gives(camera->depth.state)) trouble += (trouble.empty() ? "depth " : ", depth ") + toString(camera->depth.state);
  return trouble.empty() ? trouble : "camera: " + trouble;
}

Telemetry::Report reportOf(const Agent& agent, const std::string& robot) {
  const AgentStatistics& s = agent.statistics();
  const MetricsPage::Labels labels{{"robot", robot}};
  Telemetry::Report report;
  MetricsPage& page = report.metrics;
  page.gauge("comap_agent_info", "Version; always 1.", 1, {{"robot", robot}, {"version", COMAP_VERSION}});
  addCounts(agent, labels, page);
  addLevels(agent, labels, page);
  const auto camera = agent.captureHealth();
  if (camera) addCamera(*camera, labels, page);
  page.summary("comap_agent_odometry_seconds", "Tracking a frame and making its keyframe.", s.odometry_ms, labels);
  page.summary("comap_agent_registration_seconds", "Registering a frame against tiles.", s.localizer_ms, labels);
  report.labels = labels;
  const std::string trouble = cameraTrouble(camera);
  const size_t refused = agent.refusedKeyframes().size();
  report.readiness.ready =
      s.frames > 0 && trouble.empty() && !agent.sourceEnded() && agent.tracking() != TrackingState::kLost;
  report.readiness.state =
      fmt::format("robot {}: {}, {} frames, {} keyframes, {} wait{}, core {}", robot,
                  agent.sourceEnded() ? "source has ended"
                  : !trouble.empty()  ? trouble
                                      : fmt::format("tracking {}", trackingName(agent.tracking())),
                  s.frames, s.keyframes, agent.unacknowledged(),
                  refused == 0 ? "" : fmt::format(" ({} refused: {})", refused, agent.refusedKeyframes().reason()),
                  agent.hasPeer() ? "in sight" : "not in sight");
  return report;
}

}  // namespace comap
