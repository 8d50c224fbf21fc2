// The dense map of one reference frame: surfels on the Vulkan device, and the verbs on them.
// The map is a function of (keyframes, poses): fuse them in the same order on one device and every bit is the same.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "mapping_core/gpu/device.h"
#include "protocol/types/image.h"
#include "protocol/types/pose.h"
#include "protocol/types/result.h"

namespace comap {

/// One surfel as seen from outside the device; metres, in the map's frame.
struct Surfel {
  Eigen::Vector3f position = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< towards the observer
  float radius = 0;
  float confidence = 0;  ///< sum of fused measurement weights
  Rgb colour;
  uint32_t owner = 0;         ///< index of the keyframe it moves with: the one that created it
  uint32_t contributors = 0;  ///< bit per robot
  uint32_t observations = 0;  ///< keyframes fused into it
};

struct FusionParameters {
  float depth_min_m = 0.3f;
  float depth_max_m = 5.0f;
  float free_max_m = 12.0f;              ///< depth from depth_max_m to here is not fused, but frees what is before it
  float noise_floor_m = 0.001f;          ///< sigma_z = noise_floor + noise_factor * z^2
  float noise_factor_per_m = 0.0019f;    ///< disparity noise of a Kinect-class sensor, per metre of depth squared
  float stable_confidence = 1.5f;        ///< below it a surfel is not shown and may be cleaned up
  float averaging_limit = 50.0f;         ///< confidence counts no more than this in the running average
  uint32_t unstable_timeout = 10;        ///< fused keyframes without support after which an unstable surfel goes
  uint32_t initial_capacity = 1u << 16;  ///< surfels that a new map has room for
  uint32_t memory_mb = 0;                ///< what all surfels of a core may take on the device, 0 = what it gives
};

struct FusionReport {
  uint32_t updated = 0, inserted = 0, removed = 0, total = 0;
};

/// What a camera would see of the map. Invalid pixels have depth 0.
struct PredictedView {
  CameraModel camera;
  Image<float> depth_m;           ///< along the optical axis, ray-disc hit
  Image<Eigen::Vector3f> normal;  ///< in the camera's frame
  ColourImage colour;
  Image<float> confidence;
  Image<uint32_t> contributors;
};

struct PredictionOptions {
  float min_confidence = 0;  ///< surfels below are left out
  float max_depth_m = 20;
  bool both_sides = false;  ///< also discs seen from behind (for pictures); tracking wants false
  /// Colour, normal and confidence are the weighted mean of all discs of the front surface, instead of the nearest
  /// disc's: smooth, for pictures.
  bool blend = false;
};

/// Surfels of one map that lie together in memory.
struct SurfelBlock {
  uint64_t number = 0;  ///< no other block of the maps of one pool ever has it
  std::vector<Surfel> surfels;
};

/// What has changed of a map.
struct SurfelChanges {
  uint64_t moment = 0;               ///< now: what to ask for next time
  std::vector<uint64_t> blocks;      ///< numbers of all blocks that the map has
  std::vector<SurfelBlock> changed;  ///< those of them in which a surfel may have been changed, made or removed
};

class SurfelPool;

/// Owns device memory, in chunks (surfel_pool.h), so that no map is too large for one buffer. Thread rule: one thread
/// at a time per Device. After an error of the device the map may lack what was being done.
class SurfelMap {
 public:
  /// With a pool of its own.
  static Result<SurfelMap> create(gpu::Device& device, const FusionParameters& parameters);
  /// Shares its memory with the pool's other maps. Takes none before the first surfel.
  SurfelMap(std::shared_ptr<SurfelPool> pool, const FusionParameters& parameters);
  SurfelMap(SurfelMap&&) noexcept;
  SurfelMap& operator=(SurfelMap&&) noexcept;
  ~SurfelMap();

  /// Fuses one keyframe: bilateral filter, measurements with normals, associate (each surfel with the pixel it falls
  /// on), update, insert, clean up, stable compaction (A measurement updates at most one surfel, a surfel takes at most
  /// one measurement.) `owner` = index of the keyframe, `robot_bit` = 1 << robot index. `colour` and `depth` are of the
  /// camera's size; `depth_hits` (Keyframe::depth_hits) says how many frames agreed, empty = one.
  Result<FusionReport> fuse(const CameraModel& camera, const ColourImage& colour, const DepthImage& depth,
                            const Pose& T_map_cam, uint32_t owner, uint32_t robot_bit,
                            const Image<uint8_t>& depth_hits = {});

  /// The map from a camera pose, by splatting discs.
  Result<PredictedView> predict(const CameraModel& camera, const Pose& T_map_cam, const PredictionOptions& options);

  /// Moves each surfel with its owner: p <- T_new_old[owner] p. Owners beyond the span stay. Chunks of which nothing
  /// moves are not looked at.
  Result<void> moveOwners(std::span<const Pose> T_new_old);

  /// What has changed since `moment`, which is of an earlier answer of this map; 0: all. Only that is read.
  Result<SurfelChanges> changesSince(uint64_t moment);

  /// All surfels in their order of creation.
  Result<std::vector<Surfel>> download();
  /// All surfels of another map of this pool, moved by `T_map_other`; they come after its own. kWrongUse if the pool is
  /// another or the pose not finite. The other map is empty then.
  Result<void> absorb(SurfelMap& other, const Pose& T_map_other);
  /// Appends surfels.
  Result<void> append(std::span<const Surfel> surfels);
  void clear();
  size_t size() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace comap
