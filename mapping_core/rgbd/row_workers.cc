#include "mapping_core/rgbd/row_workers.h"

#include <algorithm>
#include <system_error>

namespace comap {
namespace {

// Small enough that a thread the system holds up does not hold up the others, large enough to be worth a lock.
constexpr int kBandsPerThread = 4;

}  // namespace

RowWorkers::RowWorkers(int threads) {
  try {
    for (int i = 1; i < threads; ++i) helpers_.emplace_back([this] { help(); });
  } catch (const std::system_error&) {  // those that run share the rows; the result is the same
  } catch (...) {
    end();  // a thread that is left would end the program
    throw;
  }
}

RowWorkers::~RowWorkers() { end(); }

void RowWorkers::end() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
  }
  begun_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void RowWorkers::run(int rows, Band band, const void* work) {
  if (rows <= 0) return;
  std::unique_lock<std::mutex> lock(mutex_);
  band_ = band;
  work_ = work;
  rows_ = unfinished_ = rows;
  step_ = std::max(1, rows / (threads() * kBandsPerThread));
  next_ = 0;
  begun_.notify_all();
  takeBands(lock);
  done_.wait(lock, [this] { return unfinished_ == 0; });
}

void RowWorkers::help() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    begun_.wait(lock, [this] { return ending_ || next_ < rows_; });
    if (ending_) return;
    takeBands(lock);
  }
}

void RowWorkers::takeBands(std::unique_lock<std::mutex>& lock) {
  while (next_ < rows_) {
    const int begin = next_, end = std::min(rows_, begin + step_);
    next_ = end;
    lock.unlock();
    band_(work_, begin, end);  // both stay as they are while a row is unfinished
    lock.lock();
    unfinished_ -= end - begin;
    if (unfinished_ == 0) done_.notify_all();
  }
}

}  // namespace comap
