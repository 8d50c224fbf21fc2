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
  heard_[witness].add(evidence);
  compared_.insert(compared_.end(), compared.begin(), compared.end());
}

size_t Probation::countIndependent(const std::vector<Closure>& closures) {
  std::vector<Closure> counted;
  for (const Closure& closure : closures)
    if (std::all_of(counted.begin(), counted.end(), [&](const Closure& one) { return independent(one, closure); }))
      counted.push_back(closure);
  return counted.size();
}

Evidence Probation::evidence() const {
  Evidence all;
  for (const auto& [witness, evidence] : heard_) all.add(evidence);
  return all;
}

size_t Probation::contradictingWitnesses(const ProbationOptions& options) const {
  return static_cast<size_t>(std::count_if(heard_.begin(), heard_.end(), [&](const auto& heard) {
    return heard.second.contradicted() > options.witness_contradicted;
  }));
}

bool Probation::manyContradict(const ProbationOptions& options) const {
  const size_t count = contradictingWitnesses(options);
  return count >= std::max<size_t>(options.contradicting_witnesses, 1) &&
         static_cast<double>(count) >= options.contradicting_share * static_cast<double>(heard_.size());
}

bool Probation::viewsContradict(const ProbationOptions& options) const {
  const Evidence all = evidence();
  return all.views >= options.fewest_views && (all.contradicted() > options.contradicted || manyContradict(options));
}

std::optional<std::string> Probation::objection(const std::map<KeyframeId, Pose>& T_map_cam,
                                                const ProbationOptions& options, const VoteOptions& vote) const {
  if (viewsContradict(options)) {
    const Evidence all = evidence();
    return fmt::format(
        "{:.1f} % of the surface that later keyframes of both maps see contradicts it, in {} views; {} of {} keyframes "
        "see much that does",
        100 * all.contradicted(), all.views, contradictingWitnesses(options), heard_.size());
  }
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
