// Random values of everything that travels, from a seed; and bytes gone bad.
#pragma once

#include <cstdint>
#include <functional>
#include <random>
#include <span>
#include <vector>

#include "protocol/codec/codec.h"

namespace comap::samples {

using Random = std::mt19937_64;

int uniform(Random& random, int low, int high);
double real(Random& random, double low, double high);
std::string robot(Random& random);
std::string map(Random& random);
KeyframeId id(Random& random);
Pose pose(Random& random);
/// Symmetric, positive semidefinite.
Matrix6d information(Random& random);
Tile tile(Random& random, size_t surfels);
/// A textured picture and a stepped depth with holes.
Keyframe keyframe(Random& random, int width, int height);

/// Rotation and translation agree to 1e-12.
bool near(const Pose& a, const Pose& b);

/// Calls `decode` on every prefix (at most ~300 of them) of `bytes` and on copies with random bits flipped, bytes
/// overwritten and runs inserted. Returns how many damaged copies were still taken as valid.
int abuse(Random& random, std::span<const uint8_t> bytes, const std::function<bool(std::span<const uint8_t>)>& decode);

}  // namespace comap::samples
