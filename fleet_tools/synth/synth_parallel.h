// Work split over a few threads; results must not depend on how.
#pragma once

#include <atomic>
#include <thread>
#include <vector>

namespace comap {

/// Calls body(i) once for each i in [0, count), from up to `threads` threads, the caller's among them.
template <class Body>
void parallelFor(int count, int threads, const Body& body) {
  std::atomic<int> next = 0;
  const auto work = [&] {
    for (int i = next++; i < count; i = next++) body(i);
  };
  std::vector<std::jthread> helpers;  // waited for at their end, also where one cannot be started
  for (int i = 1; i < threads && i < count; ++i) helpers.emplace_back(work);
  work();
}

}  // namespace comap
