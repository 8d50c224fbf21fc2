// The odometries that ours is compared to.
#pragma once

#include <memory>
#include <vector>

#include "protocol/types/camera.h"
#include "tests/benchmarks/odometry/method.h"

namespace comap {

/// The peer that speed is told in relation to.
inline constexpr char kYardstick[] = "OpenCV RgbdICP";

/// Fresh ones for a sequence of this camera; none if the program was built without COMAP_BENCHMARK_PEERS.
std::vector<std::unique_ptr<Method>> makePeers(const CameraModel& camera);

/// Whether there are any.
bool peersBuilt();

}  // namespace comap
