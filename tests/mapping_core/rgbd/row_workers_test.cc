#include "mapping_core/rgbd/row_workers.h"

#include <gtest/gtest.h>

#include <numeric>
#include <set>
#include <vector>

namespace comap {
namespace {

TEST(RowWorkers, everyRowIsWorkedOnOnce) {
  for (const int threads : {1, 2, 7}) {
    RowWorkers workers(threads);
    EXPECT_EQ(workers.threads(), threads);
    for (const int rows : {0, 1, 3, 60, 480}) {
      std::vector<int> times(static_cast<size_t>(rows), 0);
      for (int round = 0; round < 50; ++round)
        workers.share(rows, [&](int begin, int end) {
          for (int y = begin; y < end; ++y) ++times[static_cast<size_t>(y)];
        });
      for (const int count : times) EXPECT_EQ(count, 50);
    }
  }
}

// Each row waits for another thread's: this ends only if both work at a time.
TEST(RowWorkers, helpersWorkBesideTheCaller) {
  RowWorkers workers(2);
  std::mutex mutex;
  std::condition_variable changed;
  std::set<std::thread::id> seen;
  workers.share(2, [&](int, int) {
    std::unique_lock<std::mutex> lock(mutex);
    seen.insert(std::this_thread::get_id());
    changed.notify_all();
    changed.wait(lock, [&] { return seen.size() == 2; });
  });
  EXPECT_EQ(seen.size(), 2u);
}

TEST(RowWorkers, withoutWorkersTheCallerDoesAll) {
  std::vector<int> rows(10);
  shareRows(nullptr, 10, [&](int begin, int end) { std::iota(rows.begin() + begin, rows.begin() + end, begin); });
  EXPECT_EQ(rows.back(), 9);
}

}  // namespace
}  // namespace comap
