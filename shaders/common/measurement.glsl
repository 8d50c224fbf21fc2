// What one pixel of a keyframe says about the surface, beyond its depth and normal. Needs common/frame.glsl.

// Pixels between two new surfels: 2, or more where that would be closer than 2.5 mm.
uint strideOf(float z) {
  float pixel_m = z / focalLength();
  return pixel_m >= 0.00125 ? 2u : (pixel_m >= 0.000625 ? 4u : 8u);
}

// A disc that reaches a little more than half the diagonal to the next, grown with slant up to four times.
float radiusOf(float z, float normal_z) {
  float flat_radius = 0.85 * float(strideOf(z)) * z / focalLength();
  return flat_radius / max(abs(normal_z), 0.25);
}

// Weight for the distance from the image's centre: 1 there, 0.25 in a corner.
float radialWeightOf(vec2 pixel) {
  vec2 half_size = 0.5 * vec2(push.width, push.height);
  vec2 offset = pixel - push.intrinsics.zw;
  return exp(-dot(offset, offset) / dot(half_size, half_size) / 0.72);
}

const float kReferenceDepth = 2.0;

// Frames whose mean the measurement is, as the colour's word carries them, 1 to 10: what more of them say is the same.
float framesOf(uint colour_word) { return float(clamp(colour_word >> 24, 1u, 10u)); }

// What the measurement adds to a surfel's confidence. A keyframe counts once, half as much again where eight frames
// agree: then one is enough to be sure, else it takes two.
float confidenceOf(float frames) { return 1.0 + (frames - 1.0) / 14.0; }

// Its weight in the running average: inverse variance, 1 at the reference depth. Frames of one window share part of
// their error.
float precisionOf(vec2 pixel, float z, float frames) {
  float ratio = sigmaOf(kReferenceDepth) / sigmaOf(z);
  return radialWeightOf(pixel) * clamp(ratio * ratio, 0.02, 8.0) * (1.0 + (frames - 1.0) / 3.0);
}
