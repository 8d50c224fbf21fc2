// One frame of one camera into the map of its frame of reference: track, close loops, fuse, predict, remember.
#pragma once

#include "mapping_core/paper/loop_context.h"

namespace comap {

/// Milliseconds that the stages of one frame took.
struct StageTimes {
  double track = 0, loop = 0, fuse = 0, predict = 0, ferns = 0;
};

struct StepReport {
  StageTimes ms;
  bool lost = false;        ///< could not be tracked: kept its pose
  bool local_loop = false;  ///< closed in this step
  bool global_loop = false;
  LoopReport loop;  ///< of the one that was closed
};

/// Thread rule: one thread.
class SequentialMapper {
 public:
  SequentialMapper(const PaperOptions& options, const FernBook& book);

  /// The next frame of camera `index`, which moves in `frame`. `owners` tells every surfel's creation by its owner;
  /// this frame's is added. Errors are those of the device.
  Result<StepReport> step(ReferenceFrame& frame, std::vector<PaperCamera>& cameras, uint32_t index,
                          std::vector<FrameTime>& owners, const Frame& image, uint32_t tick);

  Registrar& registrar() { return registrar_; }

 private:
  void track(PaperCamera& camera, const Pyramid& live, StepReport& report);
  Result<void> closeLoops(const LoopContext& context, const Frame& image, StepReport& report);
  Result<void> fuse(ReferenceFrame& frame, PaperCamera& camera, std::vector<FrameTime>& owners, const Frame& image,
                    uint32_t tick);
  Result<void> predict(ReferenceFrame& frame, PaperCamera& camera, const Frame& image, uint32_t tick);

  const PaperOptions& options_;
  const FernBook& book_;
  Registrar registrar_;
};

}  // namespace comap
