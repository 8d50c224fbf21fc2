#include "mapping_core/graph/loop_weights.h"

#include <algorithm>
#include <cmath>

namespace comap {

double initialSharpness(std::span<const double> chi2, double gate_chi2) {
  double worst = 0;
  for (const double value : chi2) worst = std::max(worst, value);
  const double denominator = 2 * worst - gate_chi2;
  return denominator > 0 ? gate_chi2 / denominator : 0;
}

double loopWeight(double chi2, double gate_chi2, double mu) {
  if (chi2 >= (mu + 1) / mu * gate_chi2) return 0;
  if (chi2 <= mu / (mu + 1) * gate_chi2) return 1;
  return std::clamp(std::sqrt(gate_chi2 / chi2 * mu * (mu + 1)) - mu, 0.0, 1.0);
}

}  // namespace comap
