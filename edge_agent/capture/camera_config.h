// What an agent is told about its camera; the section `camera` of its configuration.
#pragma once

#include <string>

#include "edge_agent/capture/camera_rig.h"
#include "edge_agent/capture/picture_stream.h"
#include "protocol/config/config_reader.h"

namespace comap {

struct CameraConfig {
  std::string profile = "none";       ///< name of a CameraProfile
  std::string registration = "auto";  ///< auto: by the device if it can; device: depth comes registered; software
  double fps = 30;
  int shrink = 1;  ///< frames so many times smaller than colour pictures: 1, 2 or 4
  int pair_gap_ms = 20;
  double hot_celsius = 85;                            ///< from here on fewer frames are taken; 0: however hot it is
  std::string thermal_folder = "/sys/class/thermal";  ///< where the kernel tells temperatures
  CameraRig rig;
  std::string colour_format = "auto", depth_format = "auto";
  VideoControls colour_controls, depth_controls;

  CameraConfig();
  /// Of the profile; nullptr if there is none.
  const CameraProfile* builtIn() const;
};

/// Reads the section; mistakes go to the reader's list. What a profile says holds where the section says nothing.
void readCameraConfig(ConfigReader reader, CameraConfig& config);

/// The section as commented YAML that readCameraConfig takes.
std::string printCameraConfig(const CameraConfig& config);

}  // namespace comap
