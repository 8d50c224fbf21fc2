#include "fleet_tools/evaluate/metrics_trajectory.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  const fuzz::MemoryFile file(bytes);
  const auto poses = readTrajectory(file.path());
  if (!poses) return;
  for (size_t i = 1; i < poses->size(); ++i)
    fuzz::require((*poses)[i - 1].stamp_ns < (*poses)[i].stamp_ns, "stamps grow");
  (void)associate(*poses, *poses);
}
