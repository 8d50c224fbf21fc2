// Eight items per thread: software devices pay for each thread. Eight threads that run side by side there take 64 items
// in a row, eight after eight, so that memory is read from its front to its end; on others neighbours still read
// neighbours. The loop is left at its end: software devices run a body once more in vain if it is left at its head.
#ifndef COMAP_ITEMS
#define COMAP_ITEMS
#define firstItem() \
  (gl_WorkGroupID.x * 1024u + (gl_LocalInvocationID.x >> 3) * 64u + (gl_LocalInvocationID.x & 7u))
const uint kItemStep = 8u;
const uint kItemRun = 64u;
#define FOR_EACH_ITEM(count, visit)               \
  uint item_count = (count);                      \
  uint first_item = firstItem();                  \
  uint item = first_item;                         \
  for (;;) {                                      \
    if (item < item_count) visit(item);           \
    item += kItemStep;                            \
    if (item >= first_item + kItemRun) break;     \
  }
#endif
