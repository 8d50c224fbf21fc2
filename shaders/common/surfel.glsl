// The surfel streams: place = position, confidence (negative: removed); shape = normal, radius;
// look = colour r|g<<16, b|observations<<16 (colour in 1/256 steps), owner, contributors;
// record = precision, misses|violations<<8.
const float kRemoved = -1.0;

// Rows that share a word which tells that one of them has changed.
#define touchedBlock(row) ((row) >> 10)

vec3 colourOf(uvec4 look) { return vec3(look.x & 0xffffu, look.x >> 16, look.y & 0xffffu); }
uint observationsOf(uvec4 look) { return look.y >> 16; }

uvec4 packLook(vec3 colour, uint observations, uint owner, uint contributors) {
  uvec3 c = uvec3(clamp(colour + 0.5, 0.0, 65535.0));
  return uvec4(c.r | c.g << 16, c.b | min(observations, 65535u) << 16, owner, contributors);
}

// What a surfel is to the current keyframe: a word per surfel, pixel << 3 | flags.
const uint kSupported = 1u;  // its surface was measured
const uint kFits = 2u;       // and its normal too: the measurement may update it
const uint kMissed = 4u;     // its place was seen and something else was there
const uint kViolated = 5u;   // the camera saw through it, or saw the same surface shortly before it
const uint kFlagMask = 7u;
const uint kPixelShift = 3;

// The best surfel of a pixel: rank << 23 | surfel, counted through all chunks in view: push.base + its row.
const uint kNoWinner = 0xffffffffu;
const uint kSurfelMask = 0x7fffffu;
const uint kRankShift = 23;

// Behind the winners of all pixels, for each pixel the winner's row as fused: eight words, place and shape.
#define winnerRow(pixel) (push.width * push.height + 8u * (pixel))
