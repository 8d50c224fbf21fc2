// Cholesky factors of a sparse symmetric matrix of 6 x 6 blocks: the normal equations of poses and their edges.
// What Eigen's factors of single numbers do, in blocks that stay in registers: a quarter of the time.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "protocol/types/pose.h"

namespace comap {

class BlockCholesky {
 public:
  /// Which blocks below the diagonal there are, as (row, column), row > column, each once. Chooses the order of
  /// elimination.
  BlockCholesky(size_t rows, std::span<const std::pair<uint32_t, uint32_t>> below);

  /// `diagonal` by row, `below` in the order given above. False if the matrix is not positive definite.
  bool factorise(std::span<const Matrix6d> diagonal, std::span<const Matrix6d> below);
  /// x of A x = b, of the last matrix that was factorised.
  std::vector<Vector6d> solve(std::span<const Vector6d> b) const;

 private:
  struct Entry {
    uint32_t column = 0, block = 0;  // in the order of elimination; where in `below`
    bool turned = false;             // the block is of the upper half there
  };
  struct Column {
    std::vector<uint32_t> rows;  // ascending
    std::vector<Matrix6d> blocks;
    Matrix6d inverse_of_diagonal;  // of the factor's own block: lower triangular
  };

  void order(std::span<const std::pair<uint32_t, uint32_t>> below);
  void analyse();

  size_t rows_;
  std::vector<uint32_t> place_;               // of a row in the order of elimination
  std::vector<std::vector<Entry>> entries_;   // of the matrix, per place
  std::vector<std::vector<uint32_t>> reach_;  // columns of a row of the factor, each before those it changes
  std::vector<Column> columns_;
};

}  // namespace comap
