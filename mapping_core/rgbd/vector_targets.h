// To be included before Highway by files that are compiled once for each instruction set.
#pragma once

// Vectors without a fixed size (SVE, RVV) cannot be members of structs, which such loops use.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV)
