#include "mapping_core/graph/block_cholesky.h"

#include <Eigen/Cholesky>
#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <limits>

namespace comap {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

// x -= a b^T. Column by column, so that a column of x stays in registers.
void subtract(const Matrix6d& a, const Matrix6d& b, Matrix6d& x) {
  for (int c = 0; c < 6; ++c) {
    Vector6d column = x.col(c);
    for (int k = 0; k < 6; ++k) column -= b(c, k) * a.col(k);
    x.col(c) = column;
  }
}

}  // namespace

BlockCholesky::BlockCholesky(size_t rows, std::span<const std::pair<uint32_t, uint32_t>> below)
    : rows_(rows), place_(rows), entries_(rows), reach_(rows), columns_(rows) {
  order(below);
  for (uint32_t i = 0; i < below.size(); ++i) {
    const uint32_t row = place_[below[i].first], column = place_[below[i].second];
    if (row > column) {
      entries_[row].push_back({column, i, false});
    } else {
      entries_[column].push_back({row, i, true});
    }
  }
  analyse();
}

void BlockCholesky::order(std::span<const std::pair<uint32_t, uint32_t>> below) {
  std::vector<Eigen::Triplet<int>> triplets;
  for (uint32_t i = 0; i < rows_; ++i) triplets.emplace_back(i, i, 1);
  for (const auto& [row, column] : below) {
    triplets.emplace_back(row, column, 1);
    triplets.emplace_back(column, row, 1);
  }
  const auto size = static_cast<int>(rows_);
  Eigen::SparseMatrix<int> pattern(size, size);
  pattern.setFromTriplets(triplets.begin(), triplets.end());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> row_at;
  Eigen::AMDOrdering<int>()(pattern, row_at);
  for (uint32_t i = 0; i < rows_; ++i) place_[row_at.indices()(i)] = i;
}

// Which blocks the factor has: column j changes row k if j is on the way up the elimination tree from one of k's own.
void BlockCholesky::analyse() {
  std::vector<uint32_t> parent(rows_, kNone), seen(rows_, kNone), sizes(rows_, 0), way;
  for (uint32_t k = 0; k < rows_; ++k) {
    seen[k] = k;
    std::vector<uint32_t>& reach = reach_[k];
    for (const Entry& entry : entries_[k]) {
      way.clear();
      for (uint32_t j = entry.column; seen[j] != k; j = parent[j]) {
        if (parent[j] == kNone) parent[j] = k;
        way.push_back(j);
        seen[j] = k;
      }
      reach.insert(reach.end(), way.rbegin(), way.rend());
    }
    for (auto it = reach.begin(); it != reach.end(); ++it) ++sizes[*it];
    // Later ways end where earlier ones begin: from the back, each column comes before those above it.
    std::reverse(reach.begin(), reach.end());
  }
  for (uint32_t j = 0; j < rows_; ++j) {
    columns_[j].rows.reserve(sizes[j]);
    columns_[j].blocks.reserve(sizes[j]);
  }
}

bool BlockCholesky::factorise(std::span<const Matrix6d> diagonal, std::span<const Matrix6d> below) {
  for (Column& column : columns_) {
    column.rows.clear();
    column.blocks.clear();
  }
  std::vector<uint32_t> row_at(rows_);
  for (uint32_t i = 0; i < rows_; ++i) row_at[place_[i]] = i;
  std::vector<Matrix6d> row(rows_);
  for (uint32_t k = 0; k < rows_; ++k) {
    for (const uint32_t j : reach_[k]) row[j].setZero();
    for (const Entry& entry : entries_[k])
      row[entry.column] = entry.turned ? Matrix6d(below[entry.block].transpose()) : below[entry.block];
    Matrix6d rest = diagonal[row_at[k]];
    for (const uint32_t j : reach_[k]) {
      Column& column = columns_[j];
      const Matrix6d block = row[j] * column.inverse_of_diagonal.transpose();
      for (size_t i = 0; i < column.rows.size(); ++i) subtract(block, column.blocks[i], row[column.rows[i]]);
      subtract(block, block, rest);
      column.rows.push_back(k);
      column.blocks.push_back(block);
    }
    const Eigen::LLT<Matrix6d> factor(rest);
    if (factor.info() != Eigen::Success) return false;
    columns_[k].inverse_of_diagonal = factor.matrixL().solve(Matrix6d::Identity());
  }
  return true;
}

std::vector<Vector6d> BlockCholesky::solve(std::span<const Vector6d> b) const {
  std::vector<Vector6d> x(rows_), result(rows_);
  for (uint32_t i = 0; i < rows_; ++i) x[place_[i]] = b[i];
  for (uint32_t j = 0; j < rows_; ++j) {
    const Column& column = columns_[j];
    x[j] = column.inverse_of_diagonal * x[j].eval();
    for (size_t i = 0; i < column.rows.size(); ++i) x[column.rows[i]] -= column.blocks[i] * x[j];
  }
  for (uint32_t j = static_cast<uint32_t>(rows_); j-- > 0;) {
    const Column& column = columns_[j];
    for (size_t i = 0; i < column.rows.size(); ++i) x[j] -= column.blocks[i].transpose() * x[column.rows[i]];
    x[j] = column.inverse_of_diagonal.transpose() * x[j].eval();
  }
  for (uint32_t i = 0; i < rows_; ++i) result[i] = x[place_[i]];
  return result;
}

}  // namespace comap
