// The core of the paper mode: rounds of frames from all cameras, sequentially, and the maps they end in.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "mapping_core/paper/inter_map.h"
#include "mapping_core/paper/sequential_mapper.h"

namespace comap {

/// What one frame of one camera cost and did.
struct PaperFrameRecord {
  uint32_t tick = 0, camera = 0;
  StageTimes ms;
  double inter_map_ms = 0;
  size_t maps = 0, surfels = 0;  ///< after it; surfels of its own map
  bool local_loop = false, global_loop = false, merged = false, lost = false;
  size_t loop_points = 0, loop_nodes = 0;  ///< of a closed loop: constraints, and nodes that could move
};

/// One map taken into another, for good.
struct PaperMerge {
  uint32_t tick = 0;
  std::string kept, absorbed;        ///< maps
  std::vector<std::string> cameras;  ///< of the absorbed map
  std::string camera;                ///< whose view matched
  MapMatch match;                    ///< of the absorbed map's camera in the kept one
};

/// Thread rule: one thread, the device's.
class PaperCore {
 public:
  using Log = std::function<void(const std::string& line)>;
  static Result<std::unique_ptr<PaperCore>> create(gpu::Device& device, const PaperOptions& options, Log log);
  PaperCore(const PaperCore&) = delete;
  PaperCore& operator=(const PaperCore&) = delete;

  /// At most kMostCameras; kWrongUse beyond.
  Result<uint32_t> addCamera(const std::string& name);

  /// One tick: the frame of each camera, in their order; nullopt where a camera has none. kWrongUse after kLastTick
  /// rounds or for a frame whose images are not of its camera's size.
  Result<void> playRound(const std::vector<std::optional<Frame>>& frames);

  const std::vector<PaperCamera>& cameras() const { return cameras_; }
  /// The map that a camera moves in.
  const ReferenceFrame& frameOf(uint32_t camera) const { return *frames_[cameras_[camera].frame]; }
  /// Those that some camera moves in.
  std::vector<const ReferenceFrame*> maps() const;
  const std::vector<PaperFrameRecord>& records() const { return records_; }
  const std::vector<PaperMerge>& merges() const { return merges_; }
  const PaperOptions& options() const { return options_; }

 private:
  PaperCore(const PaperOptions& options, std::shared_ptr<SurfelPool> pool, Log log);
  Result<void> joinMaps(uint32_t camera, PaperFrameRecord& record);

  const PaperOptions options_;
  const FernBook book_;
  std::shared_ptr<SurfelPool> pool_;
  Log log_;
  SequentialMapper mapper_;
  InterMap inter_map_;
  std::vector<PaperCamera> cameras_;
  std::vector<std::unique_ptr<ReferenceFrame>> frames_;
  std::vector<FrameTime> owners_;  // of surfels, by their owner's number
  std::vector<PaperFrameRecord> records_;
  std::vector<PaperMerge> merges_;
  uint32_t tick_ = 0;
};

}  // namespace comap
