// What the number of a tile's revision tells beside its age.
#pragma once

#include <cstdint>

namespace comap {

/// By which revisions of tiles grow: those between are of coarse forms.
inline constexpr uint64_t kRevisionStep = 2;

/// Of the coarse form of a tile that is at `revision`, which replaces it wherever it went.
constexpr uint64_t coarseRevision(uint64_t revision) { return revision - 1; }
/// Whether who holds `held` of a tile that is now at `revision` holds a coarse form, of now or of earlier.
constexpr bool isCoarse(uint64_t held, uint64_t revision) { return (revision - held) % kRevisionStep != 0; }

}  // namespace comap
