// The C functions: arguments checked, failures to codes and sentences, no exception leaves.
#include "robot_api/comap_robot.h"

#include <algorithm>
#include <cstring>
#include <memory>
#include <new>
#include <string>

#include "protocol/types/tile_quantisation.h"
#include "robot_api/connection.h"
#include "robot_api/wire.h"

using comap::robot_api::Connection;
using comap::robot_api::Failure;
using comap::robot_api::Kind;
using comap::robot_api::Message;
using comap::robot_api::Outcome;

struct comap_robot {
  Connection connection;
  std::string error;
};

struct comap_robot_surfels {
  uint64_t snapshot = 0;
  std::string map;
  std::vector<comap_robot_surfel> surfels;
  std::vector<comap_robot_tile> tiles;
};

namespace {

using Clock = Connection::Clock;
using std::chrono::milliseconds;

constexpr milliseconds kAnswerTime{5000};  // of what the agent has at hand; it serves when it has nothing else to do
constexpr uint64_t kMostSurfels = 16'000'000;

static_assert(sizeof(comap_robot_surfel) == 36);
static_assert(sizeof(comap_robot_tile) == 32);
static_assert(COMAP_ROBOT_MAP_ID_BYTES == comap::robot_api::kMaxMapBytes + 1);

int fail(comap_robot* robot, int code, const std::string& text) {
  robot->error = text;
  return code;
}
int fail(comap_robot* robot, const Failure& failure) { return fail(robot, failure.code, failure.text); }

// Runs `work`; memory that ends and bugs must not unwind into C.
template <class Work>
int guarded(comap_robot* robot, Work work) noexcept {
  if (robot == nullptr) return COMAP_ROBOT_WRONG_USE;
  try {
    return work();
  } catch (const std::bad_alloc&) {
    robot->connection.close();  // in the middle of an answer
    robot->error.clear();
    return COMAP_ROBOT_NO_MEMORY;
  } catch (...) {
    robot->connection.close();
    robot->error.clear();
    return COMAP_ROBOT_BAD_DATA;
  }
}

// Asks, and takes the first message of the answer.
Outcome<Message> ask(comap_robot* robot, const std::string& question, Clock::time_point until) {
  if (auto failure = robot->connection.send(question, until)) return *failure;
  return robot->connection.receive(until);
}

comap_robot_transform transformOf(const comap::robot_api::PlainPose& p) {
  return {p[0], p[1], p[2], p[3], p[4], p[5], p[6]};
}

// As much of it as the caller's struct has room for.
void fill(const comap::robot_api::PoseNews& news, comap_robot_pose* to) {
  comap_robot_pose pose{};
  pose.size = to->size;
  pose.tracking = news.tracking;
  pose.map_state = news.map_state;
  pose.has_covariance = news.has_covariance ? 1 : 0;
  pose.sequence = news.sequence;
  pose.snapshot = news.snapshot;
  pose.stamp_ns = news.stamp_ns;
  pose.known_at_ns = news.known_at_ns;
  std::copy(news.map.begin(), news.map.end(), pose.map);
  pose.T_map_cam = transformOf(news.T_map_cam);
  pose.T_map_cam_exact = transformOf(news.T_map_cam_exact);
  pose.T_map_odom = transformOf(news.T_map_odom);
  pose.T_map_odom_exact = transformOf(news.T_map_odom_exact);
  pose.T_odom_cam = transformOf(news.T_odom_cam);
  std::copy(news.covariance.begin(), news.covariance.end(), pose.covariance);
  std::memcpy(to, &pose, std::min<size_t>(to->size, sizeof pose));
}

int askPose(comap_robot* robot, comap_robot_pose* pose, uint64_t after, int timeout_ms) {
  constexpr auto kFirstSize = static_cast<uint32_t>(sizeof(comap_robot_pose));  // of version 1
  if (pose == nullptr || pose->size < kFirstSize)
    return fail(robot, COMAP_ROBOT_WRONG_USE, "pose: its size is not set to sizeof(comap_robot_pose)");
  if (timeout_ms < 0)
    return fail(robot, COMAP_ROBOT_WRONG_USE,
                "timeout_ms is " + std::to_string(timeout_ms) + "; 0 or more is expected");
  const uint32_t wait_ms = std::min(static_cast<uint32_t>(timeout_ms), comap::robot_api::kLongestWait_ms);
  auto answer = ask(robot, comap::robot_api::encode(comap::robot_api::AskPose{after, wait_ms}),
                    Clock::now() + milliseconds(wait_ms) + kAnswerTime);
  if (const auto* failure = std::get_if<Failure>(&answer)) return fail(robot, *failure);
  const auto& message = std::get<Message>(answer);
  if (message.kind == Kind::kNothing) return COMAP_ROBOT_NOTHING;
  if (message.kind != Kind::kPose)
    return fail(robot, robot->connection.broken(COMAP_ROBOT_BAD_DATA, "the agent answered something else than a pose"));
  const auto news = comap::robot_api::decodePose(message.body);
  if (!news) return fail(robot, robot->connection.broken(COMAP_ROBOT_BAD_DATA, news.error().text));
  fill(*news, pose);
  return COMAP_ROBOT_OK;
}

bool isBox(const comap_robot_box& box) {
  for (int i = 0; i < 3; ++i)
    if (!(box.min_m[i] <= box.max_m[i])) return false;
  return true;
}

bool inside(const Eigen::Vector3f& p, const comap_robot_box& box) {
  for (int i = 0; i < 3; ++i)
    if (!(double{p[i]} >= box.min_m[i] && double{p[i]} <= box.max_m[i])) return false;
  return true;
}

void addTile(const comap::Tile& tile, const comap_robot_box& box, comap_robot_surfels& answer) {
  const uint64_t first = answer.surfels.size();
  for (const comap::TileSurfel& from : tile.surfels) {
    const comap::TileDisc disc = comap::dequantiseDisc(from, tile.key);
    if (!inside(disc.position, box)) continue;
    comap_robot_surfel& to = answer.surfels.emplace_back();
    std::copy_n(disc.position.data(), 3, to.position_m);
    std::copy_n(disc.normal.data(), 3, to.normal);
    to.radius_m = disc.radius_m;
    to.r = from.r;
    to.g = from.g;
    to.b = from.b;
    to.confidence = from.confidence;
    to.contributors = from.contributors;
  }
  const uint64_t count = answer.surfels.size() - first;
  if (count > 0)
    answer.tiles.push_back({tile.key.x, tile.key.y, tile.key.z, static_cast<uint32_t>(count), first, tile.revision});
}

// The tiles that a head has announced.
std::optional<Failure> readTiles(Connection& connection, const comap::robot_api::SurfelsHead& head,
                                 const comap_robot_box& box, Clock::time_point until, comap_robot_surfels& answer) {
  answer.snapshot = head.snapshot;
  answer.map = head.map;
  uint64_t surfels = 0;
  for (uint32_t i = 0; i < head.tiles; ++i) {
    auto next = connection.receive(until);
    if (const auto* failure = std::get_if<Failure>(&next)) return *failure;
    const auto& message = std::get<Message>(next);
    if (message.kind != Kind::kTile)
      return connection.broken(COMAP_ROBOT_BAD_DATA, "the agent's answer ends before its last tile");
    const auto tile = comap::robot_api::decodeTile(message.body);
    if (!tile) return connection.broken(COMAP_ROBOT_BAD_DATA, tile.error().text);
    surfels += tile->surfels.size();
    if (surfels > head.surfels)
      return connection.broken(COMAP_ROBOT_BAD_DATA, "the agent's tiles hold more surfels than it has announced");
    addTile(*tile, box, answer);
  }
  return std::nullopt;
}

}  // namespace

const char* comap_robot_version(void) { return COMAP_VERSION; }

comap_robot* comap_robot_new(void) { return new (std::nothrow) comap_robot; }

void comap_robot_free(comap_robot* robot) { delete robot; }

int comap_robot_connect(comap_robot* robot, const char* path, int timeout_ms) {
  return guarded(robot, [&] {
    if (path == nullptr || timeout_ms < 0) return fail(robot, COMAP_ROBOT_WRONG_USE, "no path, or a timeout below 0");
    if (auto failure = robot->connection.open(path, Clock::now() + milliseconds(timeout_ms)))
      return fail(robot, *failure);
    return int{COMAP_ROBOT_OK};
  });
}

int comap_robot_connected(const comap_robot* robot) { return robot != nullptr && robot->connection.isOpen() ? 1 : 0; }

const char* comap_robot_error(const comap_robot* robot) { return robot == nullptr ? "" : robot->error.c_str(); }

const char* comap_robot_name(const comap_robot* robot) {
  return robot == nullptr ? "" : robot->connection.greeting().robot.c_str();
}

uint64_t comap_robot_session(const comap_robot* robot) {
  return robot == nullptr ? 0 : robot->connection.greeting().session;
}

int comap_robot_latest_pose(comap_robot* robot, comap_robot_pose* pose) {
  return guarded(robot, [&] { return askPose(robot, pose, 0, 0); });
}

int comap_robot_wait_pose(comap_robot* robot, comap_robot_pose* pose, int timeout_ms) {
  return guarded(robot, [&] { return askPose(robot, pose, pose == nullptr ? 0 : pose->sequence, timeout_ms); });
}

int comap_robot_read_surfels(comap_robot* robot, const comap_robot_box* box, uint64_t known_snapshot,
                             uint64_t most_surfels, int timeout_ms, comap_robot_surfels** surfels) {
  if (surfels != nullptr) *surfels = nullptr;
  return guarded(robot, [&] {
    if (box == nullptr || surfels == nullptr || timeout_ms < 0)
      return fail(robot, COMAP_ROBOT_WRONG_USE, "no box, no place for the answer, or a timeout below 0");
    if (!isBox(*box)) return fail(robot, COMAP_ROBOT_WRONG_USE, "box: min_m is above max_m, or no number");
    const auto until = Clock::now() + milliseconds(timeout_ms);
    comap::robot_api::AskSurfels question;
    std::copy_n(box->min_m, 3, question.min_m.begin());
    std::copy_n(box->max_m, 3, question.max_m.begin());
    question.known_snapshot = known_snapshot;
    question.most_surfels = most_surfels == 0 ? kMostSurfels : most_surfels;
    auto first = ask(robot, comap::robot_api::encode(question), until);
    if (const auto* failure = std::get_if<Failure>(&first)) return fail(robot, *failure);
    const auto& message = std::get<Message>(first);
    if (message.kind == Kind::kUnchanged) return int{COMAP_ROBOT_UNCHANGED};
    if (message.kind != Kind::kSurfels)
      return fail(robot,
                  robot->connection.broken(COMAP_ROBOT_BAD_DATA, "the agent answered something else than surfels"));
    const auto head = comap::robot_api::decodeSurfelsHead(message.body);
    if (!head) return fail(robot, robot->connection.broken(COMAP_ROBOT_BAD_DATA, head.error().text));
    if (head->surfels > question.most_surfels)
      return fail(robot,
                  robot->connection.broken(COMAP_ROBOT_BAD_DATA, "the agent announced more surfels than asked for"));
    auto answer = std::make_unique<comap_robot_surfels>();
    if (auto failure = readTiles(robot->connection, *head, *box, until, *answer)) return fail(robot, *failure);
    *surfels = answer.release();
    return int{COMAP_ROBOT_OK};
  });
}

uint64_t comap_robot_surfels_snapshot(const comap_robot_surfels* surfels) {
  return surfels == nullptr ? 0 : surfels->snapshot;
}
const char* comap_robot_surfels_map(const comap_robot_surfels* surfels) {
  return surfels == nullptr ? "" : surfels->map.c_str();
}
uint64_t comap_robot_surfels_count(const comap_robot_surfels* surfels) {
  return surfels == nullptr ? 0 : surfels->surfels.size();
}
const comap_robot_surfel* comap_robot_surfels_data(const comap_robot_surfels* surfels) {
  return surfels == nullptr ? nullptr : surfels->surfels.data();
}
uint64_t comap_robot_surfels_tile_count(const comap_robot_surfels* surfels) {
  return surfels == nullptr ? 0 : surfels->tiles.size();
}
const comap_robot_tile* comap_robot_surfels_tiles(const comap_robot_surfels* surfels) {
  return surfels == nullptr ? nullptr : surfels->tiles.data();
}
void comap_robot_surfels_free(comap_robot_surfels* surfels) { delete surfels; }
