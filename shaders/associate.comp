// What the keyframe says about each surfel of the map, and which surfel it would update with each pixel.
// Reads the list of visible surfels, place and shape, the keyframe's measurements and its raw inverse depth (negative:
// too far to be fused, but what lies before it was seen through). Writes a match word per visible surfel, the winning
// surfel per pixel (the surest, then nearest to the ray, then oldest), and marks the pixels that need no new surfel
// because a disc covers them. One item = one visible surfel.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "common/texels.glsl"
#include "common/frame.glsl"
#include "common/surfel.glsl"
layout(local_size_x = 128) in;
layout(binding = 0) uniform samplerBuffer places;
layout(binding = 1) uniform samplerBuffer shapes;
layout(binding = 2) uniform samplerBuffer measurements;
layout(binding = 3, r32f) uniform readonly imageBuffer inverse_depth;
const int kVisibleBinding = 4;
#include "common/visible.glsl"
layout(binding = 5, r32ui) uniform uimageBuffer winners;
layout(binding = 6, r32ui) uniform uimageBuffer covered;
struct Push {
  FRAME_FIELDS
  float depth_min;
  float depth_max;
  float stable_confidence;
  uint base;  // of the chunk's rows
};
#include "common/push.glsl"

const float kNearest = 0.05;            // m
const float kSameSurfaceCosine = 0.5;   // 60 deg: the same surface, whatever its normal's noise
const float kFitCosine = 0.8775826;     // 0.5 rad
const float kSlantedCosine = 0.2;       // more slanted: less is believed of where it lies
const int kSilhouette = 2;              // pixels around in which nothing may lie as near
const int kKnownBehind = 22;            // of the 25 pixels around must be known to lie behind,
const int kKnownBehindSlanted = 25;     // all of them for a slanted surfel
const float kDoubleBehind = 0.035;      // m: a surface that far behind another, facing the same way, is a double
const float kDoubleCosine = 0.866;      // 30 deg
const float kFootprint = 8.0;           // pixels
const float kCovers = 0.7;              // of the squared radius: discs overlap, holes between three of them do not stay

// True if all that is known within two pixels of the pixel lies clearly behind depth z, and `needed` of these 25 are
// known: depth pictures have holes, at edges first, and what was taken away must not stay where they are; but a thin
// thing of which they show nothing must, so not so many may be unknown as would hide it.
bool seesThrough(ivec2 pixel, float z, int needed) {
  int behind_count = 0;
  bool blocked = false;
  for (int y = -kSilhouette; y <= kSilhouette; ++y) {
    for (int x = -kSilhouette; x <= kSilhouette; ++x) {
      ivec2 at = pixel + ivec2(x, y);
      bool inside = at.x >= 0 && at.y >= 0 && at.x < int(push.width) && at.y < int(push.height);
      float d = inside ? abs(fetchWord(inverse_depth, at.y * int(push.width) + at.x)) : 0.0;
      float behind = 1.0 / max(d, 1e-6);
      bool through = d > 0.0 && behind - z > max(0.01, 3.0 * sigmaOf(behind));
      behind_count += through ? 1 : 0;
      blocked = blocked || (d > 0.0 && !through);
    }
  }
  return !blocked && behind_count >= needed;
}

// True if all around the pixel something lies before depth z: no edge of a thin thing that lies on the surface.
bool isHidden(ivec2 pixel, float z) {
  bool hidden = true;
  for (int y = -kSilhouette; y <= kSilhouette; y += kSilhouette) {
    for (int x = -kSilhouette; x <= kSilhouette; x += kSilhouette) {
      ivec2 at = pixel + ivec2(x, y);
      bool inside = at.x >= 0 && at.y >= 0 && at.x < int(push.width) && at.y < int(push.height);
      float d = inside ? fetchWord(inverse_depth, at.y * int(push.width) + at.x) : 0.0;
      hidden = hidden && d * z > 1.0;
    }
  }
  return hidden;
}

// Marks the pixels where new surfels could start and the disc already lies.
void cover(vec3 position, vec3 normal, float radius, float gate) {
  vec2 centre = project(position);
  float reach = min(radius / position.z * focalLength(), kFootprint);
  ivec2 low = max((ivec2(floor(centre - reach)) + 1) & ~1, ivec2(0));
  ivec2 high = min(ivec2(floor(centre + reach)), ivec2(push.width, push.height) - 1);
  for (int y = low.y; y <= high.y; y += 2) {
    for (int x = low.x; x <= high.x; x += 2) {
      int at = y * int(push.width) + x;
      vec4 m = fetch(measurements, at);
      vec3 offset = rayOf(vec2(x, y)) * m.w - position;
      float height = dot(normal, offset);
      bool on = m.w > 0.0 && abs(height) < gate && dot(offset, offset) - height * height < kCovers * radius * radius &&
                dot(normal, m.xyz) > kSameSurfaceCosine;
      if (on) imageAtomicOr(covered, at, 1u);
    }
  }
}

void visit(uint item) {
  uint i = visible[item].x;
  vec4 place = fetch(places, i);
  vec3 position = toCamera(place.xyz);
  vec2 at = project(position);
  ivec2 pixel = ivec2(floor(at + 0.5));
  bool inside = position.z > kNearest && pixel.x >= 0 && pixel.y >= 0 &&
                 pixel.x < int(push.width) && pixel.y < int(push.height);
  uint word = 0u;
  if (inside) {
    vec4 shape = fetch(shapes, i);
    vec3 normal = rotateToCamera(shape.xyz);
    uint index = uint(pixel.y) * push.width + uint(pixel.x);
    vec4 m = fetch(measurements, index);
    float raw = abs(fetchWord(inverse_depth, index));
    vec3 ray = vec3(position.xy / position.z, 1.0);
    float ray_length = length(ray);
    float facing = -dot(normal, ray) / ray_length;
    bool in_range = position.z > push.depth_min && position.z < push.depth_max;
    bool measured = m.w > 0.0;

    // Depth of the measured plane along the surfel's own ray, so that slant and pixel centres do not matter.
    vec3 seen = rayOf(vec2(pixel)) * m.w;
    float plane_depth = measured ? dot(m.xyz, seen) / dot(m.xyz, ray) : 0.0;
    float in_front = (plane_depth - position.z) * ray_length;
    float gate = gateOf(plane_depth);
    float agreement = dot(normal, m.xyz);
    bool supported = measured && in_range && abs(in_front) < gate && agreement > kSameSurfaceCosine;
    bool fits = supported && (agreement > kFitCosine || place.w < push.stable_confidence);

    bool maybe_through = !supported && raw > 0.0 && 1.0 / max(raw, 1e-6) > position.z;
    int needed = abs(facing) > kSlantedCosine ? kKnownBehind : kKnownBehindSlanted;
    bool through = false;
    if (maybe_through) through = seesThrough(pixel, position.z, needed);

    // Poses that disagree by some centimetres bring the same surface again: the old one stays alone until it has been
    // contradicted often enough to go.
    float height = dot(m.xyz, position - seen);
    bool close = !supported && measured && in_range && abs(height) < kDoubleBehind && agreement > kDoubleCosine &&
                 facing > kSlantedCosine;
    bool hidden = false;
    if (close && in_front < 0.0) hidden = isHidden(pixel, position.z);
    if (close && place.w >= push.stable_confidence) cover(position, normal, shape.w, kDoubleBehind);

    if (supported) word = fits ? kSupported | kFits : kSupported;
    else if (through || hidden) word = kViolated;
    else if (measured && in_range && facing > kSlantedCosine && in_front > -gate) word = kMissed;
    word |= index << kPixelShift;

    if (supported) cover(position, normal, shape.w, gate);
    if (fits) {
      vec2 miss = at - vec2(pixel);
      uint distance = uint(min(dot(miss, miss) * 508.0, 254.0));
      uint rank = place.w >= push.stable_confidence ? distance : 255u + distance;
      imageAtomicMin(winners, int(index), rank << kRankShift | (push.base + i));
    }
  }
  visible[item].y = word;
}

void main() {
  push = given;
  FOR_EACH_VISIBLE(visit)
}
