#include "fleet_tools/synth/scene_bvh.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "fleet_tools/synth/scene_surface.h"

namespace comap {

using Eigen::AlignedBox3f;
using Eigen::Vector3f;

AlignedBox3f boundsOf(const Primitive& primitive) {
  const Vector3f reach = primitive.R_local_world.cwiseAbs().transpose() * primitive.half;
  return {primitive.centre - reach, primitive.centre + reach};
}

SceneBvh::SceneBvh(const std::vector<Primitive>& primitives) : primitives_(primitives), order_(primitives.size()) {
  std::iota(order_.begin(), order_.end(), 0);
  std::vector<AlignedBox3f> bounds;
  for (const auto& primitive : primitives) bounds.push_back(boundsOf(primitive));
  if (!primitives.empty()) build(0, static_cast<int>(primitives.size()), bounds);
}

int SceneBvh::build(int first, int last, const std::vector<AlignedBox3f>& bounds) {
  const int index = static_cast<int>(nodes_.size());
  nodes_.emplace_back();
  AlignedBox3f all, centres;
  for (int i = first; i < last; ++i) {
    const auto& box = bounds[static_cast<size_t>(order_[static_cast<size_t>(i)])];
    all.extend(box);
    centres.extend(box.center());
  }
  nodes_.back().bounds = all;
  if (last - first <= 3) {
    nodes_.back().first = first;
    nodes_.back().count = last - first;
    return index;
  }
  int axis = 0;
  centres.sizes().maxCoeff(&axis);
  const int middle = (first + last) / 2;
  std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last, [&](int a, int b) {
    const float ca = bounds[static_cast<size_t>(a)].center()[axis], cb = bounds[static_cast<size_t>(b)].center()[axis];
    return ca < cb || (ca == cb && a < b);
  });
  build(first, middle, bounds);
  const int second = build(middle, last, bounds);
  nodes_[static_cast<size_t>(index)].second = second;
  return index;
}

float SceneBvh::enterPrimitive(int index, const Vector3f& origin, const Vector3f& direction) const {
  const auto& primitive = primitives_[static_cast<size_t>(index)];
  return enter(primitive.shape, primitive.half, primitive.R_local_world * (origin - primitive.centre),
               primitive.R_local_world * direction);
}

template <class Visit>
void SceneBvh::walk(const Vector3f& origin, const Vector3f& direction, float& t_max, const Visit& visit) const {
  const Vector3f inverse = direction.cwiseInverse();
  int stack[64];
  int depth = 0;
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth > 0) {
    const int index = stack[--depth];
    const Node& node = nodes_[static_cast<size_t>(index)];
    const Vector3f t0 = (node.bounds.min() - origin).cwiseProduct(inverse);
    const Vector3f t1 = (node.bounds.max() - origin).cwiseProduct(inverse);
    const float near = t0.cwiseMin(t1).maxCoeff(), far = t0.cwiseMax(t1).minCoeff();
    if (far < 0 || near > far || near > t_max) continue;
    if (node.count == 0) {
      stack[depth++] = node.second;
      stack[depth++] = index + 1;
      continue;
    }
    for (int i = node.first; i < node.first + node.count; ++i) {
      if (visit(order_[static_cast<size_t>(i)])) return;
    }
  }
}

bool SceneBvh::blocked(const Vector3f& origin, const Vector3f& direction, float t_max) const {
  bool found = false;
  walk(origin, direction, t_max, [&](int index) { return found = enterPrimitive(index, origin, direction) < t_max; });
  return found;
}

SceneBvh::Hit SceneBvh::trace(const Vector3f& origin, const Vector3f& direction) const {
  Hit hit{std::numeric_limits<float>::infinity(), -1};
  walk(origin, direction, hit.t, [&](int index) {
    const float t = enterPrimitive(index, origin, direction);
    if (t < hit.t) hit = {t, index};
    return false;
  });
  return hit;
}

}  // namespace comap
