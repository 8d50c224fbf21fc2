// What the kernels' streams say, surfel by surfel.
#pragma once

#include <vector>

#include "mapping_core/surfels/surfel_streams.h"
#include "tests/reference/camera_reference.h"

namespace comap::reference {

/// Removed ones too, with negative confidence.
std::vector<Row> rowsOf(const StreamRows& streams);

}  // namespace comap::reference
