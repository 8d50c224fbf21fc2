// When each block of rows of a chunk was last changed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace comap {

/// Moments rise. Rows that were appended need no mark: they are noted when somebody asks.
class BlockMoments {
 public:
  void mark(size_t block, uint64_t moment);
  /// Of `rows` rows, which are all there are.
  void markAll(uint32_t rows, uint64_t moment);
  /// Rows beyond those that were there before are new.
  void noteRows(uint32_t rows, uint64_t moment);

  size_t blocks() const { return changed_.size(); }
  uint64_t of(size_t block) const { return changed_[block]; }

 private:
  std::vector<uint64_t> changed_;
  uint32_t rows_ = 0;
};

}  // namespace comap
