#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/output_file.h"
#include "fleet_tools/command_line/progress.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/export/glb.h"
#include "fleet_tools/export/map_points.h"
#include "fleet_tools/export/ply.h"
#include "fleet_tools/export/recording.h"
#include "fleet_tools/export/staged_files.h"
#include "fleet_tools/export/tiles3d.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/view/map_frame.h"
#include "mapping_core/store/map_store.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

struct ExportOptions {
  std::string store, format, out, map;
  bool json = false;
};

struct Exported {
  std::vector<std::string> files;
  size_t points = 0, poses = 0, pictures = 0, events = 0;
};

// The one map meant: that named, or the only one there is.
Result<MapId> chooseMap(const ExportOptions& options, const std::set<MapId>& maps) {
  if (maps.empty()) return Error{ErrorCode::kProblem, options.store + ": holds no map yet"};
  if (!options.map.empty()) {
    if (maps.contains(options.map)) return options.map;
    return Error{ErrorCode::kWrongUse, options.store + ": holds no map '" + printable(options.map) + "', but " +
                                           listed({maps.begin(), maps.end()})};
  }
  if (maps.size() == 1) return *maps.begin();
  return Error{ErrorCode::kWrongUse, options.store + ": holds " + std::to_string(maps.size()) +
                                         " maps, name one with --map: " + listed({maps.begin(), maps.end()})};
}

Result<std::vector<Tile>> chosenTiles(const MapStore& store, const ExportOptions& options) {
  const auto sizes = store.mapSizes();
  if (!sizes) return sizes.error();
  std::set<MapId> maps;
  for (const auto& [map, size] : *sizes) maps.insert(map);
  const Result<MapId> map = chooseMap(options, maps);
  if (!map) return map.error();
  return store.tiles(*map);
}

// From the cameras and the floors of the map that the tiles are of.
Result<Eigen::Vector3d> upOf(const MapStore& store, const std::vector<Tile>& tiles) {
  const auto keyframes = store.keyframes();
  if (!keyframes) return keyframes.error();
  std::vector<Pose> poses;
  for (const StoredKeyframe& keyframe : *keyframes)
    if (!tiles.empty() && keyframe.map == tiles.front().key.map) poses.push_back(keyframe.T_map_cam);
  std::vector<const Tile*> list;
  for (const Tile& tile : tiles) list.push_back(&tile);
  return mapFrame(list, poses).up;
}

Result<Exported> exportPoints(const MapStore& store, const ExportOptions& options) {
  const auto tiles = chosenTiles(store, options);
  if (!tiles) return tiles.error();
  std::vector<MapPoint> points;
  for (const Tile& tile : *tiles) {
    const std::vector<MapPoint> of_tile = pointsOf(tile);
    points.insert(points.end(), of_tile.begin(), of_tile.end());
  }
  StagedFiles staged;
  const std::string file = staged.stage(options.out);
  if (options.format == "ply") {
    if (const auto written = writePly(file, points); !written) return staged.named(written.error());
  } else {
    const auto up = upOf(store, *tiles);
    if (!up) return up.error();
    const GlbOptions glb{Eigen::Quaterniond::FromTwoVectors(*up, Eigen::Vector3d::UnitY()), tiles->front().key.map};
    if (const auto written = writeGlb(file, points, glb); !written) return staged.named(written.error());
  }
  if (const auto committed = staged.commit(); !committed) return committed.error();
  return Exported{{options.out}, points.size()};
}

Result<Exported> exportTiles3d(const MapStore& store, const ExportOptions& options) {
  const auto tiles = chosenTiles(store, options);
  if (!tiles) return tiles.error();
  const auto up = upOf(store, *tiles);
  if (!up) return up.error();
  StagedFiles staged;
  const auto written = writeTiles3d(staged, options.out, *tiles, *up);
  if (!written) return staged.named(written.error());
  if (const auto committed = staged.commit(); !committed) return committed.error();
  return Exported{{(fs::path(options.out) / "tileset.json").string()}, written->points};
}

std::string tumLine(const StoredKeyframe& keyframe) {
  const Eigen::Vector3d& t = keyframe.T_map_cam.translation();
  const Eigen::Quaterniond& q = keyframe.T_map_cam.rotation();
  constexpr int64_t kSecond = 1000000000;
  int64_t seconds = keyframe.stamp_ns / kSecond, rest = keyframe.stamp_ns % kSecond;
  const char* sign = keyframe.stamp_ns < 0 ? "-" : "";
  char line[256];
  std::snprintf(line, sizeof line, "%s%lld.%09lld %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n", sign,
                std::abs(static_cast<long long>(seconds)), std::abs(static_cast<long long>(rest)), t.x(), t.y(), t.z(),
                q.x(), q.y(), q.z(), q.w());
  return line;
}

// Names become file names, and a store may come from anywhere.
Result<void> checkNames(const ExportOptions& options, const StoredKeyframe& keyframe) {
  if (const std::string problem = robotNameProblem(keyframe.id.robot); !problem.empty()) {
    return Error{ErrorCode::kBadData, options.store + ": " + printable(problem)};
  }
  const bool plain = std::all_of(keyframe.map.begin(), keyframe.map.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
  });
  if (plain && keyframe.map.size() <= 100) return {};
  return Error{ErrorCode::kBadData,
               options.store + ": map name '" + printable(keyframe.map) + "', expected letters, digits, - and _"};
}

Result<Exported> exportTum(const MapStore& store, const ExportOptions& options) {
  const auto keyframes = store.keyframes();
  if (!keyframes) return keyframes.error();
  std::map<MapId, std::map<std::string, std::vector<StoredKeyframe>>> by_map;
  std::set<MapId> maps;
  for (const StoredKeyframe& keyframe : *keyframes) {
    if (keyframe.map.empty()) continue;
    if (const auto checked = checkNames(options, keyframe); !checked) return checked.error();
    maps.insert(keyframe.map);
    if (options.map.empty() || options.map == keyframe.map) by_map[keyframe.map][keyframe.id.robot].push_back(keyframe);
  }
  if (maps.size() < 2 || !options.map.empty()) {
    if (const Result<MapId> map = chooseMap(options, maps); !map) return map.error();
  }

  StagedFiles staged;
  Exported exported;
  if (const auto made = staged.makeFolder(options.out); !made) return made.error();
  for (auto& [map, robots] : by_map) {
    const fs::path folder = by_map.size() > 1 ? fs::path(options.out) / map : fs::path(options.out);
    if (const auto made = staged.makeFolder(folder); !made) return made.error();
    for (auto& [robot, own] : robots) {
      std::stable_sort(own.begin(), own.end(), [](const StoredKeyframe& a, const StoredKeyframe& b) {
        return std::pair(a.stamp_ns, a.id) < std::pair(b.stamp_ns, b.id);
      });
      const fs::path file = folder / (robot + ".trajectory.txt");
      std::ofstream out(staged.stage(file));
      out << "# keyframes of " << robot << " in the frame of map " << map << "\n# timestamp_s tx ty tz qx qy qz qw\n";
      for (const StoredKeyframe& keyframe : own) out << tumLine(keyframe);
      out.flush();
      if (!out) return Error{ErrorCode::kUnreachable, file.string() + ": cannot be written"};
      exported.files.push_back(file.string());
      exported.poses += own.size();
    }
  }
  if (const auto committed = staged.commit(); !committed) return committed.error();
  return exported;
}

Result<Exported> exportRecording(const MapStore& store, const ExportOptions& options) {
  if (!options.map.empty()) {
    const auto tiles = chosenTiles(store, options);  // says which maps there are, if not this one
    if (!tiles) return tiles.error();
  }
  const auto keyframes = store.keyframes();
  if (!keyframes) return keyframes.error();
  for (const StoredKeyframe& keyframe : *keyframes)
    if (const auto checked = checkNames(options, keyframe); !checked) return checked.error();
  StagedFiles staged;
  const auto counts = [&] {
    Progress progress("writing keyframes");
    return writeRecording(store, staged.stage(options.out), options.map,
                          [&](size_t done, size_t all) { progress.show(done, all); });
  }();
  if (!counts) return staged.named(counts.error());
  if (const auto committed = staged.commit(); !committed) return committed.error();
  return Exported{{options.out}, counts->points, counts->poses, counts->pictures, counts->events};
}

Result<Exported> exportAs(const MapStore& store, const ExportOptions& options) {
  if (options.format == "tum") return exportTum(store, options);
  if (options.format == "tiles3d") return exportTiles3d(store, options);
  if (options.format == "mcap") return exportRecording(store, options);
  return exportPoints(store, options);
}

int run(const ExportOptions& options) {
  const bool folder = options.format == "tum" || options.format == "tiles3d";
  if (const auto free = folder ? checkOutputFolder(options.out) : checkOutputFile(options.out); !free)
    return failWith(free.error());
  const Result<MapStore> store = MapStore::open(options.store, MapStore::Mode::kReadOnly);
  if (!store) return failWithStore(store.error(), options.store);
  const Result<Exported> exported = exportAs(*store, options);
  if (!exported) return failWith(exported.error());
  if (options.json) {
    printJson({{"files", exported->files},
               {"points", exported->points},
               {"poses", exported->poses},
               {"pictures", exported->pictures},
               {"events", exported->events}});
    return 0;
  }
  for (const std::string& file : exported->files) std::printf("%s\n", file.c_str());
  std::string content;
  for (const auto& [count, noun] : {std::pair(exported->points, "point"), std::pair(exported->poses, "pose"),
                                    std::pair(exported->pictures, "picture"), std::pair(exported->events, "event")})
    if (count > 0) content += (content.empty() ? "" : ", ") + counted(count, noun);
  std::printf("%s\n", content.empty() ? "nothing is in it yet" : content.c_str());
  return 0;
}

}  // namespace

void addExportVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("export", "A map as a point cloud, trajectories, or all as a recording");
  verb->footer(
      "ply, glb: one file, the surfels of one map; glb is binary glTF, whose y is up. tiles3d: a folder with a tileset "
      "of\n"
      "3D Tiles 1.1, a content for each tile of one map and thinned ones for far views. tum: a folder with\n"
      "ROBOT.trajectory.txt, the poses of its keyframes (a store has no others; a run's folder has those of all\n"
      "frames) in the frame of its map, in one folder per map if there are several. mcap: one file, a\n"
      "recording for Foxglove and others: each robot's poses, pictures and camera at their times, merges, the maps.\n"
      "Example: fleet export run/map.comap --format ply --out map.ply");
  auto options = std::make_shared<ExportOptions>();
  verb->add_option("STORE", options->store, "Map store to read")->required();
  verb->add_option("--format", options->format, "What to write")
      ->required()
      ->check(CLI::IsMember({"ply", "glb", "tiles3d", "tum", "mcap"}));
  verb->add_option(
          "--out", options->out,
          "File (ply, glb, mcap), in a folder that is there, or folder (tiles3d, tum, made if need be) to write; files "
          "that are there are replaced")
      ->required();
  verb->add_option("--map", options->map, "Which map; needed if there are several, except for tum and mcap");
  verb->add_flag("--json", options->json, "Print what was written as one JSON document");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
