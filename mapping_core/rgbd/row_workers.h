// Threads that share the rows of a picture among them. Rows that do not depend on each other give the same result,
// however many threads there are.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace comap {

/// Thread rule: one caller at a time.
class RowWorkers {
 public:
  /// The caller works too: starts `threads` - 1 threads, none for 1; fewer where the system gives no more.
  explicit RowWorkers(int threads = 1);
  ~RowWorkers();
  RowWorkers(const RowWorkers&) = delete;
  RowWorkers& operator=(const RowWorkers&) = delete;

  int threads() const { return static_cast<int>(helpers_.size()) + 1; }

  /// Calls work(begin, end) for bands of 0..rows, each row once, and returns when all are done. `work` must not throw.
  template <class Work>
  void share(int rows, const Work& work) {
    if (helpers_.empty())
      work(0, rows);
    else
      run(
          rows, [](const void* of, int begin, int end) { (*static_cast<const Work*>(of))(begin, end); }, &work);
  }

 private:
  using Band = void (*)(const void* work, int begin, int end);
  void run(int rows, Band band, const void* work);
  void help();
  void end();
  void takeBands(std::unique_lock<std::mutex>& lock);

  std::mutex mutex_;
  std::condition_variable begun_, done_;
  Band band_ = nullptr;
  const void* work_ = nullptr;
  int rows_ = 0, step_ = 1;
  int next_ = 0;        // first row that nobody has taken
  int unfinished_ = 0;  // rows
  bool ending_ = false;
  std::vector<std::thread> helpers_;
};

/// Shares rows if there are workers, else does them all here.
template <class Work>
void shareRows(RowWorkers* workers, int rows, const Work& work) {
  if (workers == nullptr)
    work(0, rows);
  else
    workers->share(rows, work);
}

}  // namespace comap
