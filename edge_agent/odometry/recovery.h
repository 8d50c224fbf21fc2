// What a robot does once it is lost: it asks its memory of places, believes only an answer that the next frame
// confirms, and after a while gives up and begins a new chain, so that mapping goes on.
#pragma once

#include <optional>

#include "edge_agent/odometry/relocaliser.h"

namespace comap {

struct RecoveryOptions {
  RelocaliserOptions relocaliser;
  int patience_frames = 15;  ///< with depth enough to start from, until a new chain begins; 0: at once
  /// Two answers from consecutive frames that differ by less confirm each other.
  double confirm_m = 0.15, confirm_rad = 0.175;
};

/// Thread rule: one thread.
class Recovery {
 public:
  explicit Recovery(const RecoveryOptions& options) : options_(options), relocaliser_(options.relocaliser) {}

  /// Remembers a keyframe as a place to come back to.
  void remember(uint32_t sequence, const Pose& T_odom_keyframe, const FernCode& code, const Pyramid& pyramid) {
    (void)relocaliser_.add(sequence, T_odom_keyframe, code, pyramid);  // it may be too much like another one
  }

  enum class Outcome {
    kLost,      ///< not found yet: ask again with the next frame
    kFound,     ///< place() is where the camera seems to stand
    kNewChain,  ///< nothing found in time, or nothing remembered: begin anew with this frame
  };
  /// Asks with one frame that has depth enough.
  Outcome attempt(const Pyramid& live, const FernCode& code);

  /// The last answer of the memory.
  const Relocalisation& place() const { return place_; }

  /// Forgets the attempts so far: the robot is on its way again.
  void reset();

 private:
  RecoveryOptions options_;
  Relocaliser relocaliser_;
  Relocalisation place_;
  std::optional<Pose> T_odom_unconfirmed_;
  int attempts_ = 0;
};

}  // namespace comap
