// Graduated non-convexity with truncated least squares: weights of loop edges between "a quadratic cost" and
// "a cost that stops growing at the gate", sharpened step by step.
#pragma once

#include <span>
#include <vector>

namespace comap {

/// The sharpness to begin with, so that even the worst edge still pulls. chi2: whitened squared residuals.
/// Returns a value <= 0 if all are below half the gate: then nothing needs a weight.
double initialSharpness(std::span<const double> chi2, double gate_chi2);

/// Weight in [0, 1] of an edge at sharpness mu > 0: 1 well below the gate, 0 well above it.
double loopWeight(double chi2, double gate_chi2, double mu);

inline constexpr double kSharpening = 1.4;  ///< factor of mu per outer iteration

}  // namespace comap
