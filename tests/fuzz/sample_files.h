// Whole files of the product's own making, for programs that damage them.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/keyframe.h"
#include "protocol/types/tile.h"

namespace comap::fuzz {

inline constexpr uint64_t kSampleSession = 7;

/// Three linked keyframes of 32x24 pixels, and their messages.
std::vector<Keyframe> sampleKeyframes(const std::string& robot);
std::vector<uint8_t> sampleMessage(const Keyframe& keyframe);

/// A map store of two robots with something in each table. Returns `path`.
std::string writeSampleStore(const std::string& path);
/// An outbox of three keyframes. Returns `path`.
std::string writeSampleOutbox(const std::string& path);
/// What a robot keeps of two maps, "m" and "n". Returns `path`.
std::string writeSampleTileStore(const std::string& path);
Tile sampleTile(const MapId& map, int x);

std::string readFile(const std::string& path);
inline std::span<const uint8_t> bytesOf(const std::string& text) {
  return {reinterpret_cast<const uint8_t*>(text.data()), text.size()};
}

}  // namespace comap::fuzz
