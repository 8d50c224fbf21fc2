#include "mapping_core/graph/edge_information.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>

namespace comap {
namespace {
constexpr double kRelativeTolerance = 1e-6;  // the matrix may have travelled in single precision
constexpr double kSmallestFloor = 1e-9;      // stands for "no floor"; keeps the scaling below finite
}  // namespace

Result<Matrix6d> squareRootInformation(const Matrix6d& information, double sigma_floor_m, double sigma_floor_rad) {
  if (!information.allFinite()) return Error{ErrorCode::kBadData, "information is not finite"};

  // In units of the floor the eigenvalues s of the information become s / (1 + s): no inverse of a matrix that may be
  // singular, and metres and radians are of like size.
  Vector6d floor;
  floor.head<3>().setConstant(std::max(sigma_floor_m, kSmallestFloor));
  floor.tail<3>().setConstant(std::max(sigma_floor_rad, kSmallestFloor));
  const Matrix6d scaled = floor.asDiagonal() * information * floor.asDiagonal();
  const double scale = scaled.cwiseAbs().maxCoeff();
  if ((scaled - scaled.transpose()).cwiseAbs().maxCoeff() > kRelativeTolerance * scale) {
    return Error{ErrorCode::kBadData, "information is not symmetric"};
  }
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(0.5 * (scaled + scaled.transpose()));
  const Vector6d s = eigen.eigenvalues();
  if (s(0) < -kRelativeTolerance * scale) {
    char text[120];
    std::snprintf(text, sizeof text,
                  "information has eigenvalue %.3g (in units of the floor), expected positive semidefinite", s(0));
    return Error{ErrorCode::kBadData, text};
  }
  const Vector6d known = s.cwiseMax(0.0).unaryExpr([](double v) { return std::sqrt(v / (1 + v)); });
  return Matrix6d(known.asDiagonal() * eigen.eigenvectors().transpose() * floor.cwiseInverse().asDiagonal());
}

Result<Matrix6d> squareRootInformation(const Edge& edge, const GraphOptions& options) {
  auto root = squareRootInformation(edge.information, options.sigma_floor_m, options.sigma_floor_rad);
  const bool closure = edge.kind == EdgeKind::kLoop || edge.kind == EdgeKind::kInterRobot;
  if (root && closure) *root /= options.closure_sigma;
  return root;
}

}  // namespace comap
