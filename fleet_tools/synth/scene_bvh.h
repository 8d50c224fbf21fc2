// A tree of bounding boxes over the solids, for rays from anywhere.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "fleet_tools/synth/scene.h"

namespace comap {

/// The smallest world-aligned box around a solid.
Eigen::AlignedBox3f boundsOf(const Primitive& primitive);

class SceneBvh {
 public:
  /// Keeps a reference: the primitives must outlive this and stay unchanged.
  explicit SceneBvh(const std::vector<Primitive>& primitives);

  /// Whether anything is entered at 0 < t < t_max.
  bool blocked(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float t_max) const;

  /// Nearest t and its primitive, -1 if none.
  struct Hit {
    float t = 0;
    int primitive = -1;
  };
  Hit trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;

 private:
  struct Node {
    Eigen::AlignedBox3f bounds;
    int first = 0, count = 0;  ///< leaf: into order_; else count = 0 and the children are next and `second`
    int second = 0;
  };
  int build(int first, int last, const std::vector<Eigen::AlignedBox3f>& bounds);
  float enterPrimitive(int primitive, const Eigen::Vector3f& origin, const Eigen::Vector3f& direction) const;
  template <class Visit>
  void walk(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction, float& t_max, const Visit& visit) const;

  const std::vector<Primitive>& primitives_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
};

}  // namespace comap
