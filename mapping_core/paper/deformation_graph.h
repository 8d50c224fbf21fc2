// An embedded deformation graph over a map's history: nodes sampled from its surfels, each with an affine motion of its
// neighbourhood; what a point near in time and space feels of them. Sumner et al.'s graph, connected along time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "mapping_core/paper/frame_time.h"
#include "protocol/types/pose.h"

namespace comap {

struct TimedPoint {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< map frame, metres
  FrameTime time;
};

struct DeformationNode {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  FrameTime time;
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
};

/// The nodes that a point moves with; weights sum to one, unless there are none.
struct Influence {
  static constexpr size_t kMost = 4;
  std::array<uint32_t, kMost> nodes{};
  std::array<double, kMost> weights{};
  size_t count = 0;
};

enum class NodeOrder {
  kTime,        ///< by time alone: as published, for one camera; what several made at one time stands side by side
  kCameraTime,  ///< by camera, then time: a point moves with nodes of its own camera
};

class DeformationGraph {
 public:
  /// One node a point, in any order.
  DeformationGraph(std::span<const TimedPoint> points, NodeOrder order);

  const std::vector<DeformationNode>& nodes() const { return nodes_; }
  std::vector<DeformationNode>& nodes() { return nodes_; }
  /// Of each node those two before and two after it; at the ends the nearest four.
  const std::vector<std::vector<uint32_t>>& neighbours() const { return neighbours_; }

  /// Of the twenty nodes nearest in time the four nearest in space.
  Influence influence(const TimedPoint& point) const;

  /// How far the nodes move the point; exactly zero if they do not move.
  Eigen::Vector3d shift(const Influence& influence, const Eigen::Vector3d& position) const;
  /// Unit normal after the motion; the same bits if the nodes do not move.
  Eigen::Vector3d turn(const Influence& influence, const Eigen::Vector3d& normal) const;
  Pose move(const Pose& T_map_cam, FrameTime time) const;

 private:
  struct Block {
    uint32_t first = 0, end = 0;
  };
  Block blockOf(FrameTime time) const;

  NodeOrder order_;
  std::vector<DeformationNode> nodes_;  // in their order
  std::vector<std::vector<uint32_t>> neighbours_;
};

}  // namespace comap
