// Stable prefix sums over blocks of 1024 flags: 128 threads with 8 consecutive flags each.
const uint kThreads = 128u;
const uint kFlagsPerThread = 8u;
shared uint scan_sums[kThreads];

// Exclusive prefix sum of `value` over the threads of the group.
uint scanThreads(uint value) {
  uint thread = gl_LocalInvocationID.x;
  scan_sums[thread] = value;
  barrier();
  for (uint step = 1u; step < kThreads; step *= 2u) {
    uint other = thread >= step ? scan_sums[thread - step] : 0u;
    barrier();
    scan_sums[thread] += other;
    barrier();
  }
  uint inclusive = scan_sums[thread];
  barrier();
  return inclusive - value;
}
