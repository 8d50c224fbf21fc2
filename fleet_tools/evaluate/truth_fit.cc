#include "fleet_tools/evaluate/truth_fit.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "fleet_tools/evaluate/keyframe_truth.h"
#include "mapping_core/store/map_store.h"
#include "protocol/codec/keyframe_codec.h"

namespace comap {
namespace {

constexpr float kFarthest_m = 4;      // depths beyond are too rough to say anything
constexpr float kMostSigma = 5;       // what does not fit at all counts no more than this
constexpr float kAlwaysWeigh = 1e4f;  // sigma: residuals are capped here, not by the weights of an alignment
constexpr size_t kFewestPoints = 100;

Result<std::shared_ptr<const KeyframeView>> viewOf(const MapStore& store, const std::string& path, const KeyframeId& id,
                                                   const DepthNoiseModel& noise) {
  const auto encoded = store.encodedKeyframe(id);
  if (!encoded) return encoded.error();
  const auto keyframe = decodeKeyframe(*encoded);
  if (!keyframe)
    return Error{keyframe.error().code, path + ": keyframe " + toString(id) + ": " + keyframe.error().text};
  return makeKeyframeView(*keyframe, kFarthest_m, noise);
}

}  // namespace

std::vector<const FitStep*> TruthFit::contradicted() const {
  std::vector<const FitStep*> found;
  for (const FitStep& step : steps)
    if (step.truth_sigma > kFactor * step.estimate_sigma) found.push_back(&step);
  std::sort(found.begin(), found.end(), [](const FitStep* a, const FitStep* b) {
    return a->truth_sigma / a->estimate_sigma > b->truth_sigma / b->estimate_sigma;
  });
  return found;
}

size_t TruthFit::truthFitsBetter() const {
  return static_cast<size_t>(std::count_if(steps.begin(), steps.end(), [](const FitStep& step) {
    return step.estimate_sigma > kFactor * step.truth_sigma;
  }));
}

std::optional<double> misfit(const KeyframeView& from, const KeyframeView& to, const Pose& T_from_to,
                             const DepthNoiseModel& noise, PointResiduals& workspace) {
  const ReferencePoints& points = from.fine.levels.back();
  const PyramidLevel& level = to.pyramid[static_cast<size_t>(points.level)];
  AssociationGates gates;
  gates.tukey_sigma = kAlwaysWeigh;
  evaluateResiduals(points, level, T_from_to, gates, {}, noise, workspace);
  double sum = 0;
  size_t compared = 0;
  for (size_t i = 0; i < points.count; ++i) {
    if (workspace.wg[i] <= 0) continue;
    const double residual = std::min(std::abs(workspace.rg[i]), kMostSigma);
    sum += residual * residual;
    ++compared;
  }
  if (compared < kFewestPoints) return std::nullopt;
  return std::sqrt(sum / static_cast<double>(compared));
}

Result<TruthFit> fitTruth(const std::string& path, const std::map<std::string, std::string>& truths) {
  auto store = MapStore::open(path, MapStore::Mode::kReadOnly);
  if (!store) return store.error();
  auto keyframes = store->keyframes();
  if (!keyframes) return keyframes.error();
  const auto truth = keyframeTruth(*keyframes, truths);
  if (!truth) return truth.error();
  std::sort(keyframes->begin(), keyframes->end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  TruthFit fit;
  const DepthNoiseModel noise;
  PointResiduals workspace;
  std::shared_ptr<const KeyframeView> before;
  const StoredKeyframe *from = nullptr, *last = nullptr;
  int64_t first_ns = 0;
  for (const StoredKeyframe& to : *keyframes) {
    if (!last || last->id.robot != to.id.robot) first_ns = to.stamp_ns;
    last = &to;
    if (to.map.empty() || !truth->contains(to.id)) {  // what follows is no step from what was before
      before = nullptr;
      continue;
    }
    const auto view = viewOf(*store, path, to.id, noise);
    if (!view) return view.error();
    if (before && from->id.robot == to.id.robot && from->id.session == to.id.session && from->map == to.map) {
      const Pose T_true = truth->at(from->id).inverse() * truth->at(to.id);
      const Pose T_estimated = from->T_map_cam.inverse() * to.T_map_cam;
      const auto of_truth = misfit(*before, **view, T_true, noise, workspace);
      const auto of_estimate = misfit(*before, **view, T_estimated, noise, workspace);
      if (of_truth && of_estimate) {
        const Pose apart = T_true.inverse() * T_estimated;
        const auto second = [&](const StoredKeyframe& at) {
          return 1e-9 * static_cast<double>(at.stamp_ns - first_ns);
        };
        fit.steps.push_back({from->id, to.id, second(*from), second(to), *of_truth, *of_estimate,
                             apart.translation().norm(), apart.angle() * 180 / std::numbers::pi});
      }
    }
    before = *view;
    from = &to;
  }
  return fit;
}

nlohmann::json toJson(const TruthFit& fit) {
  nlohmann::json contradicted = nlohmann::json::array();
  for (const FitStep* step : fit.contradicted())
    contradicted.push_back({{"from", toString(step->from)},
                            {"to", toString(step->to)},
                            {"from_s", step->from_s},
                            {"to_s", step->to_s},
                            {"truth_sigma", step->truth_sigma},
                            {"estimate_sigma", step->estimate_sigma},
                            {"apart_m", step->apart_m},
                            {"apart_deg", step->apart_deg}});
  return {{"steps", fit.steps.size()},
          {"estimate_fits_better", contradicted.size()},
          {"truth_fits_better", fit.truthFitsBetter()},
          {"contradicted", contradicted}};
}

std::string fitText(const TruthFit& fit) {
  const auto contradicted = fit.contradicted();
  std::string text = fmt::format(
      "truth        of {} steps between keyframes the depth pictures fit the estimate far better at {}, the truth at "
      "{}\n",
      fit.steps.size(), contradicted.size(), fit.truthFitsBetter());
  if (!contradicted.empty()) {
    const FitStep& worst = *contradicted.front();
    text += fmt::format(
        "             worst: {} from {:.2f} to {:.2f} s, {:.1f} sigma at the truth, {:.1f} at the estimate, {:.3f} m "
        "and "
        "{:.1f} deg apart\n",
        worst.from.robot, worst.from_s, worst.to_s, worst.truth_sigma, worst.estimate_sigma, worst.apart_m,
        worst.apart_deg);
  }
  return text;
}

}  // namespace comap
