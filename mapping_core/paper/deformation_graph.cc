#include "mapping_core/paper/deformation_graph.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <tuple>

namespace comap {
namespace {

constexpr uint32_t kCandidates = 20;

auto keyOf(FrameTime time, NodeOrder order) {
  return order == NodeOrder::kTime ? std::tuple(time.tick, time.camera) : std::tuple(time.camera, time.tick);
}

bool moves(const DeformationNode& node) { return !node.A.isIdentity(0) || !node.b.isZero(0); }

}  // namespace

DeformationGraph::DeformationGraph(std::span<const TimedPoint> points, NodeOrder order) : order_(order) {
  for (const TimedPoint& point : points) nodes_.push_back({point.position, point.time});
  std::stable_sort(nodes_.begin(), nodes_.end(), [&](const DeformationNode& a, const DeformationNode& b) {
    return keyOf(a.time, order) < keyOf(b.time, order);
  });
  neighbours_.resize(nodes_.size());
  for (uint32_t i = 0; i < nodes_.size(); ++i) {
    const Block block = blockOf(nodes_[i].time);
    const uint32_t count = std::min<uint32_t>(Influence::kMost + 1, block.end - block.first);
    const uint32_t lowest = i < block.first + 2 ? block.first : i - 2;
    const uint32_t first = std::min(lowest, block.end - count);
    for (uint32_t n = first; n < first + count; ++n)
      if (n != i) neighbours_[i].push_back(n);
  }
}

// The nodes that a time may have to do with: all, or those of its camera.
DeformationGraph::Block DeformationGraph::blockOf(FrameTime time) const {
  const auto size = static_cast<uint32_t>(nodes_.size());
  if (order_ == NodeOrder::kTime) return {0, size};
  const auto at = [&](auto found) { return static_cast<uint32_t>(found - nodes_.begin()); };
  return {at(std::lower_bound(nodes_.begin(), nodes_.end(), time.camera,
                              [](const DeformationNode& n, uint32_t camera) { return n.time.camera < camera; })),
          at(std::upper_bound(nodes_.begin(), nodes_.end(), time.camera,
                              [](uint32_t camera, const DeformationNode& n) { return camera < n.time.camera; }))};
}

Influence DeformationGraph::influence(const TimedPoint& point) const {
  Influence influence;
  const Block block = blockOf(point.time);
  if (block.first == block.end) return influence;
  const auto nearest = static_cast<uint32_t>(
      std::lower_bound(nodes_.begin() + block.first, nodes_.begin() + block.end, keyOf(point.time, order_),
                       [&](const DeformationNode& n, const auto& key) { return keyOf(n.time, order_) < key; }) -
      nodes_.begin());
  const uint32_t count = std::min(kCandidates, block.end - block.first);
  const uint32_t lowest = nearest < block.first + kCandidates / 2 ? block.first : nearest - kCandidates / 2;
  const uint32_t first = std::min(lowest, block.end - count);
  std::array<std::pair<double, uint32_t>, kCandidates> near;
  for (uint32_t i = 0; i < count; ++i) near[i] = {(nodes_[first + i].position - point.position).norm(), first + i};
  const uint32_t kept = std::min<uint32_t>(Influence::kMost + 1, count);
  std::partial_sort(near.begin(), near.begin() + kept, near.begin() + count);
  // The farthest of five only says how far the others reach.
  influence.count = kept > Influence::kMost ? Influence::kMost : kept;
  const double reach = kept > Influence::kMost ? near[kept - 1].first : 2 * near[kept - 1].first;
  double sum = 0;
  for (size_t i = 0; i < influence.count; ++i) {
    influence.nodes[i] = near[i].second;
    const double share = reach > 0 ? 1 - near[i].first / reach : 1;
    influence.weights[i] = share * share;
    sum += influence.weights[i];
  }
  for (size_t i = 0; i < influence.count; ++i)
    influence.weights[i] = sum > 0 ? influence.weights[i] / sum : 1.0 / static_cast<double>(influence.count);
  return influence;
}

Eigen::Vector3d DeformationGraph::shift(const Influence& influence, const Eigen::Vector3d& position) const {
  Eigen::Vector3d shift = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < influence.count; ++i) {
    const DeformationNode& node = nodes_[influence.nodes[i]];
    shift += influence.weights[i] * ((node.A - Eigen::Matrix3d::Identity()) * (position - node.position) + node.b);
  }
  return shift;
}

Eigen::Vector3d DeformationGraph::turn(const Influence& influence, const Eigen::Vector3d& normal) const {
  Eigen::Vector3d turned = Eigen::Vector3d::Zero();
  bool moved = false;
  for (size_t i = 0; i < influence.count; ++i) {
    const DeformationNode& node = nodes_[influence.nodes[i]];
    moved = moved || moves(node);
    // An affine motion that is next to flat has no inverse to speak of; such a node does not turn anything.
    const bool flat = std::abs(node.A.determinant()) < 1e-3;
    turned += influence.weights[i] * (flat ? normal : Eigen::Vector3d(node.A.inverse().transpose() * normal));
  }
  return moved && turned.norm() > 1e-6 ? turned.normalized() : normal;
}

Pose DeformationGraph::move(const Pose& T_map_cam, FrameTime time) const {
  const Influence felt = influence({T_map_cam.translation(), time});
  Eigen::Matrix3d blend = Eigen::Matrix3d::Zero();
  bool moved = false;
  for (size_t i = 0; i < felt.count; ++i) {
    blend += felt.weights[i] * nodes_[felt.nodes[i]].A;
    moved = moved || moves(nodes_[felt.nodes[i]]);
  }
  if (!moved) return T_map_cam;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(blend * T_map_cam.rotationMatrix(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  const Eigen::Matrix3d R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  return {R, T_map_cam.translation() + shift(felt, T_map_cam.translation())};
}

}  // namespace comap
