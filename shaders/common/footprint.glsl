// Changes pixels of a disc's footprint. Needs common/disc.glsl, and of the kernel
//   bool improves(Disc disc, ivec2 pixel): true if the disc shows there, and better than what the pixel holds;
//   void improve(Disc disc, ivec2 pixel): by an atomic.
// Software devices run both sides of each branch for eight discs side by side, and atomics one by one, also those of
// discs that have none. So all of a window of pixels is looked at first, and what is to be changed then: atomics run as
// often as the most changed disc of eight needs, not once for each pixel. Loops are left at their ends as that in
// common/items.glsl.
const int kAcross = 4;  // most discs are 3 or 4 pixels wide: as far apart as their keyframe's pixels made them
const int kDown = 8;

// Bits of the pixels to change, row by row.
uint improvedPixels(Disc disc, ivec2 corner, ivec2 last) {
  uint bits = 0u;
  uint row = 0u;
  int y = corner.y;
  for (;;) {
    uint found = 0u;
    for (int k = 0; k < kAcross; ++k) {
      int x = corner.x + k;
      bool better = improves(disc, ivec2(min(x, last.x), y));
      found |= better && x <= last.x ? 1u << k : 0u;
    }
    bits |= found << row;
    row += uint(kAcross);
    y += 1;
    if (y > last.y) break;
  }
  return bits;
}

void improveFootprint(Disc disc) {
  bool any = disc.visible && disc.low.x <= disc.high.x && disc.low.y <= disc.high.y;
  ivec2 corner = any ? disc.low : ivec2(0);
  ivec2 high = any ? disc.high : ivec2(0);
  for (;;) {
    uint bits = improvedPixels(disc, corner, min(high, corner + ivec2(kAcross, kDown) - 1));
    bits = any ? bits : 0u;
    for (;;) {
      int bit = findLSB(bits);
      if (bits != 0u) improve(disc, corner + ivec2(bit & 3, bit >> 2));
      bits &= bits - 1u;
      if (bits == 0u) break;
    }
    bool wraps = corner.x + kAcross > high.x;
    corner = wraps ? ivec2(disc.low.x, corner.y + kDown) : ivec2(corner.x + kAcross, corner.y);
    if (corner.y > high.y) break;
  }
}
