// Eight items per thread, 128 apart: software devices pay for each thread, and neighbours still read neighbours.
const uint kItemsPerThread = 8u;
#define FOR_EACH_ITEM(count, visit)                                                            \
  uint first_item = gl_WorkGroupID.x * 128u * kItemsPerThread + gl_LocalInvocationID.x;        \
  for (uint item = first_item; item < first_item + 128u * kItemsPerThread; item += 128u) {     \
    if (item < (count)) visit(item);                                                           \
  }
