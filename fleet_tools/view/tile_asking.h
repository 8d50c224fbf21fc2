// Which of the tiles that an observer holds it names to the core, so that the core sends the others: all of them, or,
// where one message is too small for that, those of one region after the other.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <map>
#include <vector>

#include "protocol/types/messages.h"
#include "protocol/types/tile.h"

namespace comap {

/// Of one map. Thread rule: one thread.
class TileAsking {
 public:
  struct Question {
    Eigen::Vector3d centre_m;
    double radius_m = 0;
    std::vector<HeldTile> held;  ///< all that is held within the radius
  };

  /// `most`: tiles that one question can name.
  explicit TileAsking(size_t most = 32768) : most_(most) {}

  /// A tile came: it is named in the next questions, wherever they are about, so that the core sees it arrive.
  void took(const TileKey& key, uint64_t revision);
  /// The next question about a map of which `tiles` are held; `viewer_m`: where to begin while all can be named.
  Question next(const std::map<TileKey, Tile>& tiles, const Eigen::Vector3d& viewer_m);

 private:
  const size_t most_;
  std::deque<HeldTile> fresh_;
  double place_ = 0;  // 0..1, in the order of the tiles' keys
};

}  // namespace comap
