#include "tests/benchmarks/localizer/played_fleet.h"

#include <unistd.h>

#include <atomic>

namespace comap {
namespace {

constexpr std::chrono::milliseconds kNoWait{0};
constexpr int kDeliveryRounds = 200;

std::filesystem::path newFolder() {
  static std::atomic<int> count{0};
  const auto folder = std::filesystem::temp_directory_path() /
                      ("comap_localizer_" + std::to_string(getpid()) + "_" + std::to_string(count++));
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace

PlayedFleet::PlayedFleet(gpu::Device& device, Log log) : log_(std::move(log)), folder_(newFolder()) {
  auto store = MapStore::open((folder_ / "map.comap").string(), MapStore::Mode::kCreateOrOpen);
  if (!store) {
    log_(store.error().text);
    return;
  }
  store_.emplace(std::move(*store));
  core_link_ = hub_.connect(LinkRole::kCore);
  ServiceOptions options;
  options.hurry_from_waiting = 0;
  options.half_detail_from_load = 0;
  options.pace_tiles = false;  // frames pass as fast as they are computed: the clock says nothing of the link
  service_ = std::make_unique<MappingService>(options, *core_link_, *store_, device,
                                              [this](LogLevel, const std::string& line) { log_("core: " + line); });
}

PlayedFleet::~PlayedFleet() {
  robots_.clear();
  service_.reset();
  store_.reset();
  std::error_code ignored;
  std::filesystem::remove_all(folder_, ignored);
}

Result<PlayedFleet::Robot*> PlayedFleet::add(const std::string& name, FrameSource& source, bool localizer) {
  if (!service_) return Error{ErrorCode::kUnreachable, "there is no store"};
  AgentConfig config;
  config.robot = name;
  config.outbox.kind = "memory";
  config.sender.send.budget_bytes_per_s = 0;
  config.sender.send.paced = false;
  config.max_waiting_keyframes = 1'000'000;
  config.localizer.enabled = localizer;
  auto outbox = Outbox::inMemory();
  if (!outbox) return outbox.error();
  auto robot = std::make_unique<Robot>();
  robot->name = name;
  robot->link = hub_.connect(LinkRole::kRobot, name);
  robot->agent = std::make_unique<Agent>(
      config, ++sessions_, std::move(*outbox), source, *robot->link,
      [this, name](const std::string& line) { log_(name + ": " + line); }, [](const FrameRecord&) {});
  if (auto greeted = robot->agent->hello(); !greeted) return greeted.error();
  robots_.push_back(std::move(robot));
  if (auto served = serve(*robots_.back()); !served) return served.error();
  return robots_.back().get();
}

Result<bool> PlayedFleet::takeFrame(Robot& robot) {
  const auto taken = robot.agent->takeFrame();
  if (!taken) return taken.error();
  if (auto sent = robot.agent->exchange(kNoWait); !sent) return sent.error();
  return *taken != Agent::Progress::kEnded;
}

Result<void> PlayedFleet::drain() {
  for (;;) {
    const auto worked = service_->step(kNoWait);
    if (!worked) return worked.error();
    if (!*worked) return {};
  }
}

Result<void> PlayedFleet::serve(Robot& robot) {
  // More keyframes may go once the first are acknowledged.
  for (uint32_t waiting = 1; waiting > 0;) {
    if (auto drained = drain(); !drained) return drained;
    if (auto heard = robot.agent->exchange(kNoWait); !heard) return heard;
    const uint32_t now = robot.agent->unacknowledged();
    if (now == waiting) break;
    waiting = now;
  }
  if (auto drained = drain(); !drained) return drained;
  return robot.agent->exchange(kNoWait);
}

Result<void> PlayedFleet::playAll(Robot& robot) {
  for (;;) {
    const auto more = takeFrame(robot);
    if (!more) return more.error();
    if (auto served = serve(robot); !served) return served;
    if (!*more) break;
  }
  if (auto refreshed = service_->refreshTiles(); !refreshed) return refreshed;
  for (int round = 0; round < kDeliveryRounds; ++round) {
    const uint64_t before = robot.agent->statistics().tiles_received;
    robot.agent->sendInterest();
    if (auto served = serve(robot); !served) return served;
    if (robot.agent->statistics().tiles_received == before) break;
  }
  return {};
}

}  // namespace comap
