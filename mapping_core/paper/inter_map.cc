#include "mapping_core/paper/inter_map.h"

#include <numbers>

namespace comap {
namespace {

// A second vote is one from elsewhere that says the same.
constexpr double kElsewhere_m = 0.3, kElsewhere_rad = 15 * std::numbers::pi / 180;
constexpr double kSame_m = 0.10, kSame_rad = 10 * std::numbers::pi / 180;

}  // namespace

bool InterMap::agreesWithEarlier(const PaperCamera& camera, const std::string& own, const std::string& other,
                                 const Pose& T_other_own) {
  auto& votes = votes_[{own, other}];
  for (const Vote& vote : votes) {
    const Pose moved = vote.T_own_cam.inverse() * camera.T_map_cam;
    const Pose differ = (vote.T_other_own * camera.T_map_cam).inverse() * (T_other_own * camera.T_map_cam);
    const bool elsewhere = moved.translation().norm() >= kElsewhere_m || moved.angle() >= kElsewhere_rad;
    if (elsewhere && differ.translation().norm() <= kSame_m && differ.angle() <= kSame_rad) return true;
  }
  votes.push_back({camera.T_map_cam, T_other_own});
  return false;
}

Result<std::optional<MapMatch>> InterMap::find(const PaperCamera& camera, const std::string& own, ReferenceFrame& other,
                                               Registrar& registrar, uint32_t tick) {
  const FernView query = fernViewOf(book_, camera.filled, camera.model);
  const auto coarse = other.ferns.match(
      query, [](const FernPlace&) { return true; }, registrar);
  if (!coarse) return std::optional<MapMatch>();
  const FernPlace& place = other.ferns.places()[coarse->place];
  const Pose T_other_guess = place.T_map_cam * coarse->T_place_cam;
  const ActiveRegion region(other.map, camera, options_, tick);
  auto view = region.predictAll(T_other_guess);
  if (!view) return view.error();
  Pyramid reference, own_view;
  buildPyramid(view->view.colour, view->view.depth_m, camera.model, kDenseLevels, reference);
  buildPyramid(camera.filled.colour, camera.filled.predicted_m, camera.model, kDenseLevels, own_view);
  const auto registered = registrar.registerViews(reference, own_view);
  if (!registered) return std::optional<MapMatch>();
  MapMatch match;
  match.fit = registered->fit;
  if (!passes(match.fit, options_.closure, camera.model, options_.fixes.independent_gates))
    return std::optional<MapMatch>();
  match.place = place.time;
  match.T_place_cam = coarse->T_place_cam * registered->T_ref_cur;
  match.T_other_own = T_other_guess * registered->T_ref_cur * camera.T_map_cam.inverse();
  if (options_.fixes.two_votes && !agreesWithEarlier(camera, own, other.name, match.T_other_own))
    return std::optional<MapMatch>();
  return std::optional<MapMatch>(match);
}

}  // namespace comap
