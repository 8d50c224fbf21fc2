// Several odometries over one sequence, frame by frame in turn: what disturbs the machine disturbs all alike.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "protocol/types/result.h"
#include "tests/benchmarks/odometry/method.h"
#include "tests/benchmarks/odometry/scores.h"

namespace comap {

using MethodsFor = std::function<std::vector<std::unique_ptr<Method>>(const CameraModel& camera)>;

/// Told each method's step on frame `index`.
using StepTold = std::function<void(size_t index, const Method& method, const Step& step)>;

/// One row a method. `place` is DIR[@FIRST:LAST], DIR has a groundtruth.txt. The errors of the source and of the
/// truth's file; kProblem if fewer than three frames have a true pose (within 0.02 s).
Result<std::vector<Row>> race(const std::string& place, const MethodsFor& methods_for, const StepTold& told);

}  // namespace comap
