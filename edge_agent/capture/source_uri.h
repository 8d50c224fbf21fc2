// Frame sources by name, as the command line and the configuration write them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "edge_agent/capture/camera_source.h"
#include "edge_agent/capture/frame_source.h"
#include "edge_agent/capture/tum_source.h"

namespace comap {

struct TumPlace {
  std::string directory;
  TumRange range;
};

/// DIR[@FIRST:LAST]; either number may be left out. A folder (or file) whose own name holds an @ is taken as it is if
/// it exists under the whole name. kWrongUse if what follows the @ is not a range.
Result<TumPlace> parseTumPlace(const std::string& text);

/// Opens `tum:DIR[@FIRST:LAST]`, plain `DIR[@FIRST:LAST]`, `icl:DIR[@FIRST:LAST]`, `klg:FILE[@FIRST:LAST]`, or a live
/// camera (openCamera, which `camera` and `log` are for); the errors of openTum, openIcl, openKlg and openCamera, and
/// kWrongUse for an unknown scheme.
Result<std::unique_ptr<FrameSource>> openSource(const std::string& uri, const CameraConfig& camera = {},
                                                CaptureLog log = nullptr);

/// One line a known scheme: how to write it and what it is.
std::vector<std::string> knownSources();

}  // namespace comap
