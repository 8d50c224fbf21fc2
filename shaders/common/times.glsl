// When each of eight cameras last saw a surfel: a tick of 16 bits each, 0 = never.
uint tickOf(uvec4 times, uint camera) { return times[camera >> 1] >> ((camera & 1u) << 4) & 0xffffu; }

uvec4 withTick(uvec4 times, uint camera, uint tick) {
  uint shift = (camera & 1u) << 4;
  times[camera >> 1] = times[camera >> 1] & ~(0xffffu << shift) | tick << shift;
  return times;
}

uint latestTick(uvec4 times) {
  uvec4 both = max(times & 0xffffu, times >> 16);
  return max(max(both.x, both.y), max(both.z, both.w));
}
