#include "mapping_core/surfels/block_moments.h"

#include <algorithm>

#include "mapping_core/surfels/surfel_kernels.h"

namespace comap {
namespace {

size_t blocksOf(uint32_t rows) { return (size_t{rows} + kBlockItems - 1) / kBlockItems; }

}  // namespace

void BlockMoments::mark(size_t block, uint64_t moment) {
  if (block >= changed_.size()) changed_.resize(block + 1);
  changed_[block] = moment;
}

void BlockMoments::markAll(uint32_t rows, uint64_t moment) {
  changed_.assign(blocksOf(rows), moment);
  rows_ = rows;
}

void BlockMoments::noteRows(uint32_t rows, uint64_t moment) {
  if (rows == rows_) return;
  changed_.resize(blocksOf(rows));
  std::fill(changed_.begin() + rows_ / kBlockItems, changed_.end(), moment);
  rows_ = rows;
}

}  // namespace comap
