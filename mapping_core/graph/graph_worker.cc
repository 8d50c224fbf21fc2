#include "mapping_core/graph/graph_worker.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace comap {
namespace {

constexpr int kAgain = 20;  // solves without news, at most: what has not come to rest then stays so

// What a caller did not take is not lost with the solution that replaces it: poses are, as the newer ones hold all.
void inherit(GraphUpdate& update, const GraphUpdate& older) {
  const auto add = [](std::vector<EdgeKey>& into, const std::vector<EdgeKey>& from,
                      const std::vector<EdgeKey>& undone) {
    for (const EdgeKey& key : from)
      if (std::find(undone.begin(), undone.end(), key) == undone.end()) into.push_back(key);
  };
  const std::vector<EdgeKey> used = update.used;
  add(update.used, older.used, update.rejected);
  add(update.rejected, older.rejected, used);
}

}  // namespace

Result<void> apply(const GraphChange& change, GraphSolver& solver) {
  if (const auto* keyframe = std::get_if<GraphKeyframe>(&change))
    return solver.addKeyframe(keyframe->id, keyframe->T_map_cam, keyframe->hangs_on);
  if (const auto* edge = std::get_if<Edge>(&change)) return solver.addEdge(*edge);
  solver.removeEdge(std::get<GraphRemoval>(change).key);
  return {};
}

GraphWorker::GraphWorker(const GraphSolverOptions& options)
    : options_(options), thread_([this](const std::stop_token& stop) { run(stop); }) {}

GraphWorker::~GraphWorker() = default;  // jthread asks to stop, which wakes the wait, and joins

uint64_t GraphWorker::post(std::vector<GraphChange> changes) {
  const std::lock_guard lock(mutex_);
  posted_ += changes.size();
  waiting_.insert(waiting_.end(), std::make_move_iterator(changes.begin()), std::make_move_iterator(changes.end()));
  bell_.notify_all();
  return posted_;
}

std::optional<Result<GraphUpdate>> GraphWorker::takeLocked() {
  if (error_) return Result<GraphUpdate>(*std::exchange(error_, std::nullopt));
  if (solution_) return Result<GraphUpdate>(*std::exchange(solution_, std::nullopt));
  return std::nullopt;
}

std::optional<Result<GraphUpdate>> GraphWorker::take() {
  const std::lock_guard lock(mutex_);
  return takeLocked();
}

std::optional<Result<GraphUpdate>> GraphWorker::finish() {
  std::unique_lock lock(mutex_);
  bell_.wait(lock, [this] { return waiting_.empty() && !busy_; });
  return takeLocked();
}

void GraphWorker::run(const std::stop_token& stop) {
  GraphSolver solver(options_);
  int again = 0;  // solves still due without news
  uint64_t applied = 0;
  while (!stop.stop_requested()) {
    std::vector<GraphChange> changes;
    {
      std::unique_lock lock(mutex_);
      if (!bell_.wait(lock, stop, [&] { return !waiting_.empty() || again > 0; })) return;
      changes.swap(waiting_);
      busy_ = true;
    }
    std::optional<Error> problem;
    for (const GraphChange& change : changes)
      if (auto applying = apply(change, solver); !applying && !problem) problem = applying.error();
    applied += changes.size();
    again = changes.empty() ? again - 1 : kAgain;
    Result<GraphUpdate> update = solver.solve();
    if (!update || update->settled) again = 0;
    if (!update && !problem) problem = update.error();

    const std::lock_guard lock(mutex_);
    if (problem && !error_) error_ = problem;
    if (update) {
      update->revision = applied;
      if (solution_) inherit(*update, *solution_);
      solution_ = std::move(*update);
    }
    busy_ = again > 0;
    bell_.notify_all();
  }
}

}  // namespace comap
