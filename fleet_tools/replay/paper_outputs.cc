#include "fleet_tools/replay/paper_outputs.h"

#include <sys/resource.h>

#include <algorithm>
#include <map>
#include <set>

#include "fleet_tools/export/map_points.h"
#include "fleet_tools/render/robot_order.h"
#include "fleet_tools/replay/frames_csv.h"
#include "fleet_tools/replay/run_trajectory.h"
#include "fleet_tools/report/map_pictures.h"
#include "fleet_tools/report/run_page.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

using Json = nlohmann::json;

Json spread(std::vector<double> values) {
  if (values.empty()) return nullptr;
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<size_t>(share * static_cast<double>(values.size() - 1))];
  };
  return {{"median", at(0.5)}, {"p95", at(0.95)}, {"worst", values.back()}};
}

Json spreadOf(const std::vector<PaperFrameRecord>& records, const auto& value) {
  std::vector<double> values;
  for (const PaperFrameRecord& record : records) values.push_back(value(record));
  return spread(std::move(values));
}

// Of all cameras together, tick by tick.
Json spreadOfRounds(const std::vector<PaperFrameRecord>& records) {
  std::map<uint32_t, double> rounds;
  for (const PaperFrameRecord& record : records) rounds[record.tick] += totalMs(record);
  std::vector<double> values;
  for (const auto& [tick, ms] : rounds) values.push_back(ms);
  return spread(std::move(values));
}

std::set<std::string> robotsOf(const PaperCore& core, const ReferenceFrame& map) {
  std::set<std::string> names;
  for (const PaperCamera& camera : core.cameras())
    if (&core.frameOf(camera.index) == &map) names.insert(camera.name);
  return names;
}

Json poseJson(const Pose& pose) {
  const auto& t = pose.translation();
  const auto& q = pose.rotation();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

Json robotJson(const PaperCore& core, const PaperRobot& robot, uint32_t camera) {
  uint32_t lost = 0;
  for (const PaperFrameRecord& record : core.records()) lost += record.camera == camera && record.lost;
  return {{"frames", robot.frames},
          {"damaged_frames", robot.damaged_frames},
          {"uplink_bytes", robot.uplink_bytes},
          {"uplink_bytes_per_s", robot.duration_s > 0 ? static_cast<double>(robot.uplink_bytes) / robot.duration_s : 0},
          {"tracking_lost_frames", lost},
          {"ate_rmse_m", nullptr},
          {"map", core.frameOf(camera).name}};
}

// Of the frame that a camera had at a tick; 0 if it had none.
int64_t stampAt(const PaperCamera& camera, uint32_t tick) {
  const auto found = std::find_if(camera.log.begin(), camera.log.end(), [&](const auto& p) { return p.tick == tick; });
  return found == camera.log.end() ? 0 : found->stamp_ns;
}

Json mergeJson(const PaperCore& core, const PaperMerge& merge, size_t number) {
  const auto& cameras = core.cameras();
  const auto asking =
      std::find_if(cameras.begin(), cameras.end(), [&](const auto& c) { return c.name == merge.camera; });
  return {{"number", number},
          {"tick", merge.tick},
          {"kept", merge.kept},
          {"absorbed", merge.absorbed},
          {"robots", merge.cameras},
          {"T_kept_absorbed", poseJson(merge.match.T_other_own)},
          {"query", {{"robot", merge.camera}, {"stamp_ns", stampAt(*asking, merge.tick)}}},
          {"place",
           {{"robot", cameras[merge.match.place.camera].name},
            {"stamp_ns", stampAt(cameras[merge.match.place.camera], merge.match.place.tick)}}},
          {"T_place_query", poseJson(merge.match.T_place_cam)},
          {"inliers", merge.match.fit.inliers},
          {"rms_m", merge.match.fit.rms_m}};
}

// By contributor bit.
std::vector<std::string> namesOf(const PaperCore& core) {
  std::vector<std::string> names;
  for (const PaperCamera& camera : core.cameras()) names.push_back(camera.name);
  return names;
}

Json reportJson(const PaperCore& core, const PaperOutcome& outcome) {
  Json report;
  report["mode"] = "paper";
  for (uint32_t i = 0; i < outcome.robots.size(); ++i)
    report["robots"][outcome.robots[i].name] = robotJson(core, outcome.robots[i], i);
  report["timeline"]["unit"] = "frame";
  for (const PaperCamera& camera : core.cameras()) {
    if (!camera.log.empty())
      report["timeline"]["robots"][camera.name] = {{"first", camera.log.front().tick},
                                                   {"last", camera.log.back().tick}};
  }
  const std::vector<std::string> names = namesOf(core);
  const std::vector<size_t> places = placesByName(names);
  for (size_t i = 0; i < names.size(); ++i) report["robots"][names[i]]["colour"] = places[i];
  report["maps"] = Json::array();
  for (const ReferenceFrame* map : core.maps())
    report["maps"].push_back({{"id", map->name},
                              {"robots", robotsOf(core, *map)},
                              {"surfels", map->map.size()},
                              {"places", map->ferns.places().size()}});
  report["merges"] = Json::array();
  for (const PaperMerge& merge : core.merges())
    report["merges"].push_back(mergeJson(core, merge, report["merges"].size() + 1));
  const auto& records = core.records();
  const auto count = [&](bool PaperFrameRecord::*flag) {
    return std::count_if(records.begin(), records.end(), [&](const auto& r) { return r.*flag; });
  };
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  report["core"] = {{"frame_ms", spreadOf(records, totalMs)},
                    {"round_ms", spreadOfRounds(records)},
                    {"stages_ms",
                     {{"track", spreadOf(records, [](const auto& r) { return r.ms.track; })},
                      {"loops", spreadOf(records, [](const auto& r) { return r.ms.loop; })},
                      {"fuse", spreadOf(records, [](const auto& r) { return r.ms.fuse; })},
                      {"predict", spreadOf(records, [](const auto& r) { return r.ms.predict; })},
                      {"ferns", spreadOf(records, [](const auto& r) { return r.ms.ferns; })},
                      {"inter_map", spreadOf(records, [](const auto& r) { return r.inter_map_ms; })}}},
                    {"local_loops", count(&PaperFrameRecord::local_loop)},
                    {"local_loops_unbent", std::count_if(records.begin(), records.end(),
                                                         [](const auto& r) { return r.local_loop && !r.loop_nodes; })},
                    {"global_loops", count(&PaperFrameRecord::global_loop)},
                    {"device", outcome.device},
                    {"peak_rss_mb", static_cast<double>(usage.ru_maxrss) / 1024}};
  for (const PaperFix& fix : kPaperFixes) {
    std::string key = fix.name;
    std::replace(key.begin(), key.end(), '-', '_');
    report["fixes"][key] = core.options().fixes.*fix.chosen;
  }
  report["joint_ate_rmse_m"] = nullptr;
  report["surface"] = {{"accuracy_mean_m", nullptr}, {"accuracy_median_m", nullptr}, {"completeness_2cm", nullptr}};
  report["wall_s"] = outcome.wall_s;
  report["version"] = COMAP_VERSION;
  return report;
}

}  // namespace

Result<Json> writePaperOutputs(const ReplayOptions& options, const PaperCore& core, const PaperOutcome& outcome) {
  for (const PaperCamera& camera : core.cameras()) {
    std::vector<StampedPose> poses;
    for (const LoggedPose& pose : camera.log) poses.push_back({pose.stamp_ns, pose.T_map_cam});
    if (auto written = writeTrajectory(options.out + "/" + camera.name + ".trajectory.txt", poses); !written)
      return written.error();
  }
  if (auto written = writeWholeFile(options.out + "/frames.csv", framesCsv(core.records(), namesOf(core))); !written)
    return written.error();

  const auto maps = core.maps();
  const ReferenceFrame* largest = *std::max_element(
      maps.begin(), maps.end(), [](const auto* a, const auto* b) { return a->map.size() < b->map.size(); });
  const auto timed = largest->map.download();
  if (!timed) return timed.error();
  std::vector<Surfel> surfels;
  for (const TimedSurfel& one : *timed)
    if (one.surfel.confidence >= core.options().fusion.stable_confidence) surfels.push_back(one.surfel);
  if (auto written = writePly(options.out + "/map.ply", pointsOf(surfels)); !written) return written.error();
  const Json report = reportJson(core, outcome);
  if (auto written = writeWholeFile(options.out + "/report.json", report.dump(2) + "\n"); !written)
    return written.error();

  if (!surfels.empty()) {
    std::vector<Pose> T_map_cams;
    for (const PaperCamera& camera : core.cameras())
      if (&core.frameOf(camera.index) == largest)
        for (const LoggedPose& pose : camera.log) T_map_cams.push_back(pose.T_map_cam);
    const auto names = orderContributors(namesOf(core), surfels);
    if (auto painted = paintMap(options.out, options.device, names, surfels, T_map_cams); !painted)
      return painted.error();
  }
  if (auto written = writeRunPage(options.out); !written) return written.error();
  return report;
}

}  // namespace comap
