// An outbox in a folder of its own, and keyframes to put into it.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/edge_agent/uplink/keyframes.h"

namespace comap {

inline std::vector<uint8_t> messageOf(uint32_t sequence) {
  return *encodeKeyframe(keyframeAt(5, sequence, 0.1 * sequence, 0.1 * sequence - 0.1));
}

/// Keyframes `first` to `end` - 1 of session 5.
inline void put(Outbox& outbox, uint32_t first, uint32_t end) {
  for (uint32_t i = first; i < end; ++i) {
    const auto added = outbox.add(rowOf(keyframeAt(5, i, 0.1 * i, 0.1 * i - 0.1)), messageOf(i));
    ASSERT_TRUE(added) << added.error().text;
  }
}

class OutboxFile : public testing::Test {
 protected:
  ScratchFolder folder_;
  const std::string path_ = folder_.file("r.outbox");
};

}  // namespace comap
