// Robots that look around in one analytic room, and what maps their keyframes make.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <vector>

#include "mapping_core/service/map_builder.h"

namespace comap {

/// Where the keyframe's camera stands in its room. Robots from 'x' on are in another room, of the same shape, and stand
/// there as b, c ... in the first.
Pose roomPose(char robot, uint32_t sequence);

/// Keyframe `sequence` of a robot: each looks around from a place of its own, so that all see the same walls. Odometry
/// is the truth but for noise of a millimetre.
Keyframe roomKeyframe(char robot, uint32_t sequence);

/// Options with which a few keyframes in the room suffice for loops.
MapBuilderOptions roomOptions();

/// Puts the keyframe into the store as an ingest would.
void keep(MapStore& store, const Keyframe& keyframe);

/// Maps keyframes [first, last) of each of `robots`, which take turns, as a core would. Returns all that it caused.
MapChange mapAll(MapBuilder& builder, MapStore& store, const std::string& robots, uint32_t first, uint32_t last);
/// The same, for those who want to know only about merges: keyframes [first, last) of each of `robots`, which take
/// turns, as a core would: kept, read back, mapped.
std::vector<MergeRecord> mapTurns(MapBuilder& builder, MapStore& store, const std::string& robots, uint32_t first,
                                  uint32_t last);

/// As if the keyframes `sequence` of both robots had been matched, where `error` moves what robot `b` sees.
void forgeMatch(MapStore& store, char a, char b, uint32_t sequence, const Pose& error = {}, double information = 1e5);

/// A map's name -> hash of its tiles.
using MapHashes = std::map<MapId, uint64_t>;
MapHashes hashesOf(MapBuilder& builder);
/// Ends a run as a core does, and tells what came of it.
MapHashes finish(MapBuilder& builder);

}  // namespace comap
