#include "mapping_core/paper/map_deformation.h"

#include <algorithm>

namespace comap {

DeformationGraph sampleGraph(const std::vector<TimedSurfel>& surfels, const std::vector<FrameTime>& owners,
                             size_t stride, size_t most, NodeOrder order) {
  const size_t step = std::max(stride, (surfels.size() + most - 1) / most);
  std::vector<TimedPoint> points;
  for (size_t i = 0; i < surfels.size(); i += step)
    points.push_back({surfels[i].surfel.position.cast<double>(), owners[surfels[i].surfel.owner]});
  return {points, order};
}

Result<void> deformMap(TimedSurfelMap& map, const std::vector<FrameTime>& owners, const DeformationGraph& graph,
                       uint32_t tick) {
  return map.rewrite([&](TimedSurfel& surfel) {
    const FrameTime time = owners[surfel.surfel.owner];
    if (time.tick == tick) return;
    const Eigen::Vector3d position = surfel.surfel.position.cast<double>();
    const Influence felt = graph.influence({position, time});
    surfel.surfel.position = (position + graph.shift(felt, position)).cast<float>();
    surfel.surfel.normal = graph.turn(felt, surfel.surfel.normal.cast<double>()).cast<float>();
  });
}

}  // namespace comap
