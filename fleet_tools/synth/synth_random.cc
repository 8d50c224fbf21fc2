#include "fleet_tools/synth/synth_random.h"

#include <array>
#include <cmath>
#include <memory>

namespace comap {
namespace {

// The p-quantile of N(0, 1) by bisection of erfc: slow, and run once per table entry.
double normalQuantile(double p) {
  double low = -8, high = 8;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

using Table = std::array<float, kNormalEntries>;

std::unique_ptr<const Table> makeTable() {
  auto table = std::make_unique<Table>();
  for (size_t i = 0; i < table->size(); ++i) {
    (*table)[i] =
        static_cast<float>(normalQuantile((static_cast<double>(i) + 0.5) / static_cast<double>(table->size())));
  }
  return table;
}

}  // namespace

const float* normalTable() {
  static const std::unique_ptr<const Table> table = makeTable();
  return table->data();
}

}  // namespace comap
