// The report of a run as one HTML file for a person: pictures inside, nothing loaded from anywhere.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace comap {

struct ReportPicture {
  std::string title;
  std::vector<uint8_t> png;  ///< the bytes of a PNG file
  bool by_robot = false;     ///< in the robots' colours, so their names go below
  /// Of the picture itself, where pictures of several runs stand together; else the page's.
  std::map<std::string, size_t> colours = {};
};

struct ReportError {
  double t_s = 0;  ///< any clock
  double error_m = 0;
};

struct ReportTrajectory {
  std::string robot;
  std::vector<Eigen::Vector3d> positions;   ///< metres, map frame: x right, y down, z ahead of the map's first camera
  std::string map;                          ///< robots of one map share a plot
  size_t colour = 0;                        ///< as in pictures of who contributed what
  std::vector<Eigen::Vector3d> truth = {};  ///< aligned to the map; empty if not known
  std::vector<ReportError> errors = {};     ///< in order of time; empty if there is no truth
};

/// A whole HTML page. `report` has the keys of report.json; any of them may be null, absent or of another type, and is
/// then left out. Texts are escaped. Positions and errors that are not finite are left out.
std::string renderReportPage(const nlohmann::json& report, const std::vector<ReportPicture>& pictures,
                             const std::vector<ReportTrajectory>& trajectories);

/// The part of a page that shows pictures with their titles; empty without pictures. `robots`, name -> colour, are the
/// legend of those in the robots' colours. `layout`: "pictures", as many beside each other as fit, or "pairs".
std::string pictureGallery(const std::vector<ReportPicture>& pictures, const std::map<std::string, size_t>& robots,
                           const std::string& layout = "pictures");

/// The number of each robot's colour: what the report says, else its place in the order of names.
std::map<std::string, size_t> robotColours(const nlohmann::json& report);

/// A page's head up to the first element of its body.
std::string pageHead(const std::string& title);

}  // namespace comap
