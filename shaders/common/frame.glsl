// The camera of a keyframe or view, as every kernel gets it: rows of T_cam_map, pinhole, noise model.
// Pixel (i, j) has its centre at the continuous coordinate (i, j).
#define FRAME_FIELDS \
  vec4 row0;         \
  vec4 row1;         \
  vec4 row2;         \
  vec4 intrinsics;   \
  uint width;        \
  uint height;       \
  float noise_floor; \
  float noise_factor;

#define toCamera(x) (vec3(dot(push.row0.xyz, x), dot(push.row1.xyz, x), dot(push.row2.xyz, x)) + \
                     vec3(push.row0.w, push.row1.w, push.row2.w))
#define rotateToCamera(v) vec3(dot(push.row0.xyz, v), dot(push.row1.xyz, v), dot(push.row2.xyz, v))
#define rotateToMap(v) (push.row0.xyz * (v).x + push.row1.xyz * (v).y + push.row2.xyz * (v).z)
#define toMap(x) rotateToMap((x) - vec3(push.row0.w, push.row1.w, push.row2.w))

// The ray of a pixel, z = 1, and the pixel of a point.
#define rayOf(pixel) vec3(((pixel) - push.intrinsics.zw) * (1.0 / push.intrinsics.xy), 1.0)
#define project(x) ((x).xy / (x).z * push.intrinsics.xy + push.intrinsics.zw)
#define focalLength() (0.5 * (abs(push.intrinsics.x) + abs(push.intrinsics.y)))

// Standard deviation of depth, and the distance within which two depths are taken for one surface.
#define sigmaOf(z) (push.noise_floor + push.noise_factor * (z) * (z))
#define gateOf(z) clamp(3.0 * sigmaOf(z), 0.01, 0.05)
