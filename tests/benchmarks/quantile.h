// What benchmarks say of many measured values.
#pragma once

#include <algorithm>
#include <vector>

namespace comap {

/// The q-quantile (0..1; 1 = the largest) of values in any order; 0 for none.
inline double quantileOf(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  const size_t k = std::min(values.size() - 1, static_cast<size_t>(q * static_cast<double>(values.size())));
  std::nth_element(values.begin(), values.begin() + static_cast<long>(k), values.end());
  return values[k];
}

}  // namespace comap
