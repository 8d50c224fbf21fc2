// Reads a GLB as the specification says, strictly, for tests.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace comap {

struct GlbPoints {
  nlohmann::json json;
  std::vector<Eigen::Vector3f> positions, normals;
  std::vector<std::array<uint8_t, 4>> colours;
  std::vector<float> radii, confidences;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  ///< of the node
  std::string problem;                                           ///< empty if the file keeps every rule looked at
};

GlbPoints readGlb(const std::string& path);

}  // namespace comap
