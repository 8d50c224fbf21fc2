// The part of MappingService that says how it does, to those who watch over it.
#include "mapping_core/service/mapping_service.h"
#include "protocol/codec/codec.h"

namespace comap {

ServiceState MappingService::state() const {
  const auto now = std::chrono::steady_clock::now();
  ServiceState state;
  const auto since = [&](std::chrono::steady_clock::time_point then) {
    return std::chrono::duration<double>(now - then).count();
  };
  for (const auto& [robot, index] : robot_index_) state.robots[robot];
  for (const auto& [robot, present] : presence_.robots())
    if (present) state.robots[robot].silent_s = since(started_);
  for (const auto& [robot, record] : registry_.robots()) {
    ServiceState::Robot& one = state.robots[robot];
    one.refused = registry_.refuses(robot, now);
    one.finished = record.finished;
    const bool heard = record.heard != std::chrono::steady_clock::time_point();  // more than its hello
    one.silent_s = heard ? std::optional(since(record.heard)) : std::nullopt;
    one.served = heard && record.refusal.empty();
  }
  state.store_failure = store_health_.failure();
  for (const KeyframeId& anchor : builder_.components().anchors())
    state.surfels[mapIdOf(anchor)] = builder_.surfelCount(anchor);
  state.surfel_bytes = builder_.surfelBytes();
  state.keyframes = keyframes_;
  state.waiting = static_cast<uint32_t>(ingest_.waiting());
  state.unfused = static_cast<uint32_t>(builder_.unfused());
  state.on_probation = static_cast<uint32_t>(builder_.onProbation().size());
  state.load = load_.figure(now);
  return state;
}

void MappingService::publishStatus() {
  CoreStatus status;
  status.keyframes = keyframes_;
  status.maps = static_cast<uint32_t>(builder_.components().anchors().size());
  status.queue = static_cast<uint32_t>(ingest_.waiting());
  status.device = device_.info().name;
  send(Topic::kCoreStatus, "", encodeCoreStatus(status));
}

}  // namespace comap
