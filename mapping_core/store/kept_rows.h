// Which rows of a table are whole.
#pragma once

#include <cstdint>
#include <vector>

namespace comap {

/// Numbers that are kept, in rising order, as runs within which no row was found damaged.
class KeptRows {
 public:
  struct Run {
    int64_t first = 0, last = 0;
    size_t count = 0;  ///< numbers that nobody has are in no run's way
  };
  void add(int64_t number) {
    if (broken_) runs_.push_back({number, number, 0});
    broken_ = false;
    runs_.back().last = number;
    ++runs_.back().count;
  }
  /// Between the last one and the next lies one that is not kept.
  void skip() {
    broken_ = true;
    all_ = false;
  }
  /// From here on rows could not be read one behind the other.
  void leaveOrder() {
    skip();
    in_order_ = false;
  }
  /// Whether all rows, kept or not, were read one behind the other, in rising order.
  bool inOrder() const { return in_order_; }
  const std::vector<Run>& runs() const { return runs_; }
  /// Whether there is no row that is not kept.
  bool all() const { return all_; }
  size_t size() const {
    size_t sum = 0;
    for (const Run& run : runs_) sum += run.count;
    return sum;
  }

 private:
  std::vector<Run> runs_;
  bool broken_ = true, all_ = true, in_order_ = true;
};

}  // namespace comap
