// Fills a list of surfels: those in view that isListed(row) admits. Needs common/frame.glsl, common/visible.glsl,
// places, blocks as list_blocks left them, and push.count, push.min_confidence, push.max_depth, push.margin.
const float kNearest = 0.05;  // m
const uint kThreads = 128u;
const uint kSurfelsPerThread = 8u;
shared uint list_count;
shared uint list_base;

bool isVisible(uint i) {
  vec4 place = fetch(places, i);
  vec3 position = toCamera(place.xyz);
  vec2 at = project(position);
  vec2 size = vec2(push.width, push.height);
  return place.w >= push.min_confidence && position.z > kNearest && position.z < push.max_depth &&
         at.x > -push.margin && at.y > -push.margin && at.x < size.x + push.margin && at.y < size.y + push.margin &&
         isListed(i);
}

void main() {
  push = given;
  uint thread = gl_LocalInvocationID.x;
  uint first = (fetchWord(blocks, 4u + gl_WorkGroupID.x) * kThreads + thread) * kSurfelsPerThread;
  uint flags = 0u;
  for (uint k = 0u; k < kSurfelsPerThread; ++k) {
    flags |= first + k < push.count && isVisible(min(first + k, push.count - 1u)) ? 1u << k : 0u;
  }
  if (thread == 0u) list_count = 0u;
  barrier();
  uint slot = atomicAdd(list_count, uint(bitCount(flags)));
  barrier();
  if (thread == 0u) {
    list_base = atomicAdd(visible_header.w, list_count);
    atomicMax(visible_header.x, (list_base + list_count + 1023u) / 1024u);
    atomicMax(visible_header.y, 1u);
    atomicMax(visible_header.z, 1u);
  }
  barrier();
  slot += list_base;
  for (uint k = 0u; k < kSurfelsPerThread; ++k) {
    if ((flags >> k & 1u) != 0u) visible[slot++].x = first + k;
  }
}
