// A surfel's disc in a view. Needs common/frame.glsl and push.both_sides, push.max_depth, push.min_confidence.
struct Disc {
  vec3 position;  // in the camera's frame
  vec3 normal;
  float plane;   // normal times position: of all points of its plane
  float weight;  // 1 / radius squared
  bool visible;
  ivec2 low;   // footprint, pixels
  ivec2 high;
};

const float kNearest = 0.05;        // m
const float kGrazingCosine = 0.09;  // 85 deg
const float kFootprint = 32.0;      // most pixels from the centre to the rim

Disc discOf(vec4 place, vec4 shape) {
  Disc disc;
  disc.position = toCamera(place.xyz);
  disc.normal = rotateToCamera(shape.xyz);
  disc.plane = dot(disc.normal, disc.position);
  disc.weight = 1.0 / (shape.w * shape.w);
  float z = disc.position.z;
  float facing = -disc.plane / length(disc.position);
  facing = push.both_sides != 0u ? abs(facing) : facing;
  disc.visible = place.w >= push.min_confidence && z > kNearest && z < push.max_depth && facing > kGrazingCosine;

  // The disc reaches r sqrt(1 - n_a^2) along axis a.
  vec3 extent = shape.w * sqrt(max(1.0 - disc.normal * disc.normal, vec3(0.0)));
  float nearest = max(z - extent.z, 0.5 * z);
  vec2 centre = project(disc.position);
  vec2 reach = (extent.xy + abs(disc.position.xy / z) * extent.z) * abs(push.intrinsics.xy) / nearest;
  reach = min(reach, vec2(kFootprint));
  vec2 size = vec2(push.width, push.height);
  disc.visible = disc.visible && all(greaterThan(centre + reach, vec2(-0.5))) && all(lessThan(centre - reach, size));
  disc.low = ivec2(max(ceil(centre - reach), vec2(0.0)));
  disc.high = ivec2(min(floor(centre + reach), size - 1.0));
  return disc;
}

// Where the ray meets the disc's plane: depth, and squared distance from the centre relative to the radius. The same
// bits wherever it is asked for, so that who looks first and writes later writes what it has seen.
vec2 hit(Disc disc, vec3 ray) {
  precise float depth = disc.plane / dot(disc.normal, ray);
  precise vec3 offset = ray * depth - disc.position;
  precise float apart = dot(offset, offset) * disc.weight;
  return vec2(depth, apart);
}
