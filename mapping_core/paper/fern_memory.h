// The places that one map remembers: small filled views with their fern codes and poses, and recognising them.
#pragma once

#include <optional>

#include "mapping_core/ferns/fern_book.h"
#include "mapping_core/ferns/place_index.h"
#include "mapping_core/paper/filled_view.h"
#include "mapping_core/paper/frame_time.h"
#include "mapping_core/paper/registration.h"

namespace comap {

/// A view small enough to keep: an eighth of its size.
struct FernView {
  FernCode code;
  Pyramid pyramid;     ///< of its four levels only the last has content
  ColourImage colour;  ///< of that size
};

FernView fernViewOf(const FernBook& book, const FilledView& view, const CameraModel& camera);

struct FernPlace {
  FernView view;
  FrameTime time;
  Pose T_map_cam;
};

struct FernMatch {
  size_t place = 0;
  Pose T_place_cam;  ///< of the camera that asked
};

/// Thread rule: one thread.
class FernMemory {
 public:
  explicit FernMemory(const FernOptions& options) : options_(options) {}

  /// Remembers a view that differs enough from all others; whether it did.
  bool harvest(FernView view, FrameTime time, const Pose& T_map_cam);

  /// The most similar place that `admit` lets pass, if small images align and look alike there. One candidate, one try.
  std::optional<FernMatch> match(const FernView& query, const std::function<bool(const FernPlace&)>& admit,
                                 Registrar& registrar) const;

  /// Takes in all places of another map, which lies at T_map_other in this one.
  void absorb(FernMemory&& other, const Pose& T_map_other);

  std::vector<FernPlace>& places() { return places_; }
  const std::vector<FernPlace>& places() const { return places_; }

 private:
  FernOptions options_;
  PlaceIndex index_;
  std::vector<FernPlace> places_;
};

}  // namespace comap
