// A graph solver on a thread of its own, so that mapping goes on while poses are corrected. Changes are handed over by
// value in order; solutions carry the number of changes they know, and only the latest is kept.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <variant>
#include <vector>

#include "mapping_core/graph/graph_solver.h"

namespace comap {

/// One thing that happens to the graph.
struct GraphKeyframe {
  KeyframeId id;
  Pose T_map_cam;
  std::optional<KeyframeId> hangs_on;
};
struct GraphRemoval {
  EdgeKey key;
};
using GraphChange = std::variant<GraphKeyframe, Edge, GraphRemoval>;

/// Applies one change; errors as GraphSolver gives them. Removing what is not there is no error.
Result<void> apply(const GraphChange& change, GraphSolver& solver);

/// Thread rule: any thread may call; calls do not wait for solving. Ends, after the round under way, when destroyed.
class GraphWorker {
 public:
  explicit GraphWorker(const GraphSolverOptions& options = {});
  ~GraphWorker();
  GraphWorker(const GraphWorker&) = delete;
  GraphWorker& operator=(const GraphWorker&) = delete;

  /// Hands changes over; they are solved together with all others that wait. Returns the number of changes so far: a
  /// solution of that revision or a higher one knows them.
  uint64_t post(std::vector<GraphChange> changes);
  /// The first error of a change or of the solver since the last call, if there was one; else the latest solution, if
  /// it was not taken yet. After an error the worker goes on with what is left.
  std::optional<Result<GraphUpdate>> take();
  /// Waits until everything posted so far is solved and at rest, then as take(). For an end of work and for tests.
  std::optional<Result<GraphUpdate>> finish();

 private:
  void run(const std::stop_token& stop);
  std::optional<Result<GraphUpdate>> takeLocked();

  GraphSolverOptions options_;
  std::mutex mutex_;
  std::condition_variable_any bell_;
  std::vector<GraphChange> waiting_;     // guarded by mutex_
  std::optional<GraphUpdate> solution_;  // guarded by mutex_
  std::optional<Error> error_;           // guarded by mutex_
  uint64_t posted_ = 0;                  // guarded by mutex_
  bool busy_ = false;                    // guarded by mutex_
  std::jthread thread_;                  // last: it uses all of the above
};

}  // namespace comap
