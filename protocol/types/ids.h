// Names of things that travel.
#pragma once

#include <compare>
#include <cstdint>
#include <string>

namespace comap {

/// Unique for ever: `session` is new at each start of the robot's agent, `sequence` counts keyframes from 0.
struct KeyframeId {
  std::string robot;
  uint64_t session = 0;
  uint32_t sequence = 0;
  auto operator<=>(const KeyframeId&) const = default;
};

/// "robot/session/sequence", for people and for keys in files.
std::string toString(const KeyframeId& id);

/// A map's name: that of the keyframe its frame of reference is fixed to.
using MapId = std::string;

/// The name of the map that is anchored at this keyframe: "robot-session-sequence".
MapId mapIdOf(const KeyframeId& anchor);

/// Robot names are 1-32 characters of [a-z0-9_-]; empty string if `name` is one, else what is wrong with it.
std::string robotNameProblem(const std::string& name);

}  // namespace comap
