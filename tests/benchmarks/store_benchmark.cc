// How long fleet's questions to a store take at size:
//   store_benchmark [--keyframes N] [--tiles N] [--out FILE] [--verbs "info,doctor,..."]
// A verb's words after its name follow the store's.
// Makes a store of robots that walk a building (small pictures, so that rows and not bytes are measured), then runs
// each verb as its own process and prints wall time, processor time and exit code.
#include <sys/resource.h>
#include <sys/wait.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <set>

#include "mapping_core/store/map_store.h"
#include "protocol/codec/keyframe_codec.h"
#include "tests/benchmarks/command_line.h"
#include "tests/scenes/building_graph.h"

namespace comap {
namespace {

struct Arguments {
  int keyframes = 100000, tiles = 5000, surfels_per_tile = 300;
  std::string out = "store_benchmark.comap";
  // The last ones change the store: a split and its undoing, and a robot that goes.
  std::vector<std::string> verbs = {"info",
                                    "merges",
                                    "matches --reason round_trip",
                                    "matches",
                                    "doctor",
                                    "doctor --full",
                                    "recover --later",
                                    "split 2 --later",
                                    "split 2 --undo --later",
                                    "forget r3 --later"};
};

constexpr int kWidth = 32, kHeight = 24;

Keyframe pictureOf(const BuildingGraph::Keyframe& keyframe, std::mt19937& engine) {
  Keyframe made;
  made.id = keyframe.id;
  made.camera = {20, 20, 15.5, 11.5, kWidth, kHeight};
  made.colour = ColourImage(kWidth, kHeight, Rgb{90, 120, 150});
  made.depth = DepthImage(kWidth, kHeight, 2000);
  made.fern_code = {1, std::vector<uint8_t>(500)};
  for (uint8_t& code : made.fern_code.codes) code = static_cast<uint8_t>(engine() % 16);
  made.T_odom_cam = keyframe.T_map_odometry;
  made.linked = keyframe.id.sequence > 0;
  if (made.linked) {
    made.linked_to = keyframe.id.sequence - 1;
    made.T_link_this = keyframe.edges[0].T_from_to;
    made.information = keyframe.edges[0].information;
  }
  return made;
}

// Robots join the map of the first one, each by the first closures that tie it to those that have.
class Joining {
 public:
  void see(const KeyframeId& id) {
    if (firsts_.emplace(id.robot, id).second) order_.push_back(id.robot);
  }
  /// Makes an edge a closure of its merge, if it is one.
  void mark(Edge& edge) {
    if (edge.kind != EdgeKind::kInterRobot) return;
    if (joined_.empty()) joined_.insert(order_.front());
    const bool from = joined_.contains(edge.from.robot), to = joined_.contains(edge.to.robot);
    if (from == to) return;
    const std::string robot = from ? edge.to.robot : edge.from.robot;
    MergeRecord& merge = merges_[robot];
    if (merge.number == 0) merge.number = static_cast<uint32_t>(merges_.size());
    edge.merge = merge.number;
    merge.voters.push_back(edge.to);
    if (merge.voters.size() < kVotes) return;
    joined_.insert(robot);
    merge.kept = mapIdOf(firsts_.at(order_.front()));
    merge.absorbed = mapIdOf(firsts_.at(robot));
    merge.robots.assign(joined_.begin(), joined_.end());
    merge.keyframes_ingested = edge.to.sequence;
  }
  Result<void> store(MapStore& store) const {
    for (const auto& [robot, merge] : merges_)
      if (auto added = store.addMerge(merge); !added) return added;
    return {};
  }
  size_t robots() const { return order_.size(); }

 private:
  static constexpr size_t kVotes = 6;
  std::map<std::string, KeyframeId> firsts_;
  std::vector<std::string> order_;
  std::set<std::string> joined_;
  std::map<std::string, MergeRecord> merges_;
};

Result<void> fill(const Arguments& arguments) {
  BuildingOptions options;
  options.keyframes = arguments.keyframes;
  const BuildingGraph building = makeBuildingGraph(options);
  auto store = MapStore::open(arguments.out, MapStore::Mode::kCreateOrOpen);
  if (!store) return store.error();
  auto transaction = store->begin();
  if (!transaction) return transaction.error();
  std::mt19937 engine(1);
  std::map<KeyframeId, Pose> poses;
  Joining joining;
  size_t verdicts = 0;
  const char* reasons[] = {"inlier_ratio", "round_trip", "degenerate", "accepted"};
  for (size_t i = 0; i < building.keyframes.size(); ++i) {
    const auto& keyframe = building.keyframes[i];
    const auto encoded = encodeKeyframe(pictureOf(keyframe, engine));
    if (!encoded) return encoded.error();
    if (auto added = store->addKeyframe(keyframe.id, static_cast<int64_t>(i) * 1'000'000, *encoded); !added)
      return added.error();
    poses[keyframe.id] = keyframe.T_map_cam;
    joining.see(keyframe.id);
    for (Edge edge : keyframe.edges) {
      // How the building knows where its robots start; here merges tell it.
      if (edge.kind == EdgeKind::kOdometry && edge.from.robot != edge.to.robot) continue;
      joining.mark(edge);
      if (auto added = store->addEdge(edge); !added) return added.error();
      if (edge.kind != EdgeKind::kLoop && edge.kind != EdgeKind::kInterRobot) continue;
      MatchVerdict verdict;
      verdict.query = edge.to;
      verdict.candidate = edge.from;
      verdict.reason = reasons[verdicts++ % 4];
      verdict.accepted = verdict.reason == "accepted";
      if (auto added = store->addVerdict(verdict); !added) return added.error();
    }
  }
  const MapId map = mapIdOf(building.keyframes.front().id);
  if (auto set = store->setPoses(map, poses); !set) return set.error();
  if (auto added = joining.store(*store); !added) return added;
  std::vector<Tile> tiles(static_cast<size_t>(arguments.tiles));
  for (size_t i = 0; i < tiles.size(); ++i) {
    tiles[i].key = {map, static_cast<int>(i % 100), static_cast<int>(i / 100 % 100), static_cast<int>(i / 10000)};
    tiles[i].revision = 1;
    tiles[i].surfels.resize(static_cast<size_t>(arguments.surfels_per_tile));
  }
  if (auto set = store->setTiles(tiles); !set) return set.error();
  if (auto set = store->setMeta("complete", "yes"); !set) return set.error();
  std::printf("%s: %d keyframes of %zu robots, %zu edges, %zu verdicts, %d tiles\n", arguments.out.c_str(),
              arguments.keyframes, joining.robots(), building.edges, verdicts, arguments.tiles);
  return transaction->commit();
}

double secondsOf(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

int measure(const std::string& fleet, const std::string& verb, const std::string& store) {
  const size_t space = verb.find(' ');
  std::string command = "'" + fleet + "' " + verb.substr(0, space) + " '" + store + "'";
  if (space != std::string::npos) command += verb.substr(space);
  if (verb.starts_with("recover")) command += " --out '" + store + ".saved'";
  const auto start = std::chrono::steady_clock::now();
  rusage before{}, after{};
  getrusage(RUSAGE_CHILDREN, &before);
  const int status = std::system((command + " > /dev/null").c_str());
  getrusage(RUSAGE_CHILDREN, &after);
  const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const double cpu =
      secondsOf(after.ru_utime) + secondsOf(after.ru_stime) - secondsOf(before.ru_utime) - secondsOf(before.ru_stime);
  const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  std::printf("%-30s %7.2f s wall, %7.2f s processor, exit code %d\n", verb.c_str(), wall, cpu, code);
  std::fflush(stdout);
  return code;
}

}  // namespace
}  // namespace comap

int main(int argc, char** argv) {
  using namespace comap;
  Arguments arguments;
  CLI::App app("How long fleet's questions to a store take at size");
  app.add_option("--keyframes", arguments.keyframes)->capture_default_str()->check(CLI::Range(200, 1000000));
  app.add_option("--tiles", arguments.tiles)->capture_default_str()->check(CLI::Range(0, 1000000));
  app.add_option("--out", arguments.out, "Store to make; one that is there is used as it is")->capture_default_str();
  app.add_option("--verbs", arguments.verbs, "What to time")->delimiter(',')->capture_default_str();
  if (const auto code = comap::endOfParsing(app, argc, argv)) return *code;
  if (!std::filesystem::exists(arguments.out))
    if (auto filled = fill(arguments); !filled) {
      std::fprintf(stderr, "store_benchmark: %s\n", filled.error().text.c_str());
      return 3;
    }
  std::error_code problem;
  std::printf("%.0f MB\n", 1e-6 * static_cast<double>(std::filesystem::file_size(arguments.out, problem)));
  const std::string fleet = (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "fleet").string();
  std::filesystem::remove(arguments.out + ".saved");
  for (const std::string& verb : arguments.verbs)
    if (measure(fleet, verb, arguments.out) != 0) return 1;
  return 0;
}
