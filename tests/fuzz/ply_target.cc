#include "fleet_tools/export/ply.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  const fuzz::MemoryFile file(bytes);
  const auto points = readPly(file.path());
  if (!points) return;
  const size_t count = points->positions.size();
  fuzz::require(points->normals.empty() || points->normals.size() == count, "a normal for each point, or none");
  fuzz::require(points->radii.empty() || points->radii.size() == count, "a radius for each point, or none");
  for (const auto& position : points->positions) fuzz::require(position.allFinite(), "points are finite");
}
