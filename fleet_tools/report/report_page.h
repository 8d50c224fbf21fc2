// The report of a run as one HTML file for a person: pictures inside, nothing loaded from anywhere.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace comap {

struct ReportPicture {
  std::string title;
  std::vector<uint8_t> png;  ///< the bytes of a PNG file
};

struct ReportTrajectory {
  std::string robot;
  std::vector<Eigen::Vector3d> positions;  ///< metres, map frame: x right, y down, z ahead of the map's first camera
  std::string map;                         ///< robots of one map share a plot
};

/// A whole HTML page. `report` has the keys of report.json; any of them may be null, absent or of another type, and is
/// then left out. Texts are escaped. Positions that are not finite are left out.
std::string renderReportPage(const nlohmann::json& report, const std::vector<ReportPicture>& pictures,
                             const std::vector<ReportTrajectory>& trajectories);

/// The part of a page that shows pictures with their titles; empty without pictures.
std::string pictureGallery(const std::vector<ReportPicture>& pictures);

}  // namespace comap
