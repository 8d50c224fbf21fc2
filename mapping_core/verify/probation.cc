#include "mapping_core/verify/probation.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace comap {

Probation::Probation(uint32_t merge, MergeSides sides, const std::vector<Closure>& voters)
    : merge_(merge), sides_(std::move(sides)), supporters_(voters) {}

void Probation::follow(const KeyframeId& id, const KeyframeId& previous) {
  if (const auto side = sideOf(previous)) sides_[id] = *side;
}

std::optional<bool> Probation::sideOf(const KeyframeId& id) const {
  const auto found = sides_.find(id);
  if (found == sides_.end()) return std::nullopt;
  return found->second;
}

bool Probation::between(const Closure& closure) const {
  const auto query = sideOf(closure.query), candidate = sideOf(closure.candidate);
  return query && candidate && *query != *candidate;
}

void Probation::hear(const KeyframeId& witness, const std::vector<ComparedViews>& compared, const Evidence& evidence) {
  if (evidence.views == 0) return;
  evidence_.add(evidence);
  witnesses_.insert(witness);
  compared_.insert(compared_.end(), compared.begin(), compared.end());
}

size_t Probation::countIndependent(const std::vector<Closure>& closures) {
  std::vector<Closure> counted;
  for (const Closure& closure : closures)
    if (std::all_of(counted.begin(), counted.end(), [&](const Closure& one) { return independent(one, closure); }))
      counted.push_back(closure);
  return counted.size();
}

bool Probation::viewsContradict(const ProbationOptions& options) const {
  return evidence_.views >= options.fewest_views && evidence_.contradicted() > options.contradicted;
}

std::optional<std::string> Probation::objection(const std::map<KeyframeId, Pose>& T_map_cam,
                                                const ProbationOptions& options, const VoteOptions& vote) const {
  if (viewsContradict(options))
    return fmt::format("{:.1f} % of the surface that later keyframes of both maps see contradicts it, in {} views",
                       100 * evidence_.contradicted(), evidence_.views);
  const Together one_side = [this](const KeyframeId& a, const KeyframeId& b) { return sideOf(a) == sideOf(b); };
  size_t most = 0;
  for (const Closure& one : opponents_) {
    std::vector<Closure> agreeing{one};
    for (const Closure& other : opponents_) {
      const bool second = std::all_of(agreeing.begin(), agreeing.end(),
                                      [&](const Closure& counted) { return independent(counted, other); });
      if (second && agree(one, other, one_side, T_map_cam, vote)) agreeing.push_back(other);
    }
    most = std::max(most, agreeing.size());
  }
  if (most < std::max<size_t>(vote.needed, 1) || most < supporters()) return std::nullopt;
  return fmt::format("{} closures that agree with each other contradict it, {} support it", most, supporters());
}

}  // namespace comap
