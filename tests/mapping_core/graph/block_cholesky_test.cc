// Factors of normal equations in blocks, against dense ones.
#include "mapping_core/graph/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>

namespace comap {
namespace {

struct Equations {
  std::vector<std::pair<uint32_t, uint32_t>> pairs;
  std::vector<Matrix6d> diagonal, below;
  std::vector<Vector6d> right;
  Eigen::MatrixXd dense;
};

// A chain with loops: each edge adds what an edge between two poses would.
Equations chainWithLoops(uint32_t rows, int loops, uint32_t seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> noise;
  const auto random = [&] { return Matrix6d(Matrix6d::NullaryExpr([&] { return noise(engine); })); };
  Equations e;
  e.dense = Eigen::MatrixXd::Identity(6 * rows, 6 * rows) * 0.1;
  std::vector<std::pair<uint32_t, uint32_t>> ends;
  for (uint32_t i = 1; i < rows; ++i) ends.emplace_back(i, i - 1);
  for (int i = 0; i < loops; ++i) {
    const auto a = static_cast<uint32_t>(engine() % rows), b = static_cast<uint32_t>(engine() % rows);
    if (a > b + 1) ends.emplace_back(a, b);
  }
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  for (const auto& [a, b] : ends) {
    const Matrix6d j = random(), k = random();
    e.dense.block<6, 6>(6 * a, 6 * a) += j.transpose() * j;
    e.dense.block<6, 6>(6 * b, 6 * b) += k.transpose() * k;
    e.dense.block<6, 6>(6 * a, 6 * b) += j.transpose() * k;
    e.dense.block<6, 6>(6 * b, 6 * a) += k.transpose() * j;
  }
  e.pairs = ends;
  for (uint32_t i = 0; i < rows; ++i) {
    e.diagonal.push_back(e.dense.block<6, 6>(6 * i, 6 * i));
    e.right.push_back(random().col(0));
  }
  for (const auto& [a, b] : ends) e.below.push_back(e.dense.block<6, 6>(6 * a, 6 * b));
  return e;
}

TEST(BlockCholesky, SolvesWhatDenseFactorsSolve) {
  for (const uint32_t rows : {1u, 2u, 7u, 60u}) {
    const Equations e = chainWithLoops(rows, rows > 2 ? static_cast<int>(rows) : 0, rows);
    BlockCholesky factors(rows, e.pairs);
    ASSERT_TRUE(factors.factorise(e.diagonal, e.below));
    ASSERT_TRUE(factors.factorise(e.diagonal, e.below)) << "once more, of the same shape";
    Eigen::VectorXd right(6 * rows);
    for (uint32_t i = 0; i < rows; ++i) right.segment<6>(6 * i) = e.right[i];
    const Eigen::VectorXd expected = e.dense.ldlt().solve(right);
    const auto found = factors.solve(e.right);
    for (uint32_t i = 0; i < rows; ++i)
      EXPECT_LT((found[i] - expected.segment<6>(6 * i)).norm(), 1e-8 * (1 + expected.norm())) << i << " of " << rows;
  }
}

TEST(BlockCholesky, RefusesWhatIsNotPositiveDefinite) {
  Equations e = chainWithLoops(5, 3, 1);
  BlockCholesky factors(5, e.pairs);
  e.diagonal[3] = -e.diagonal[3];
  EXPECT_FALSE(factors.factorise(e.diagonal, e.below));
}

}  // namespace
}  // namespace comap
