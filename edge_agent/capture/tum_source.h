// A recorded sequence in the TUM RGB-D format as a frame source.
#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <string>

#include "edge_agent/capture/frame_source.h"
#include "edge_agent/capture/tum_index.h"

namespace comap {

/// Frames of a sequence by index from 0: `first` inclusive, `last` exclusive; kToEnd = as many as there are.
struct TumRange {
  static constexpr size_t kToEnd = std::numeric_limits<size_t>::max();
  size_t first = 0;
  size_t last = kToEnd;
};

/// The range with its end known, of the `total` frames of `what` ("the sequence"). kWrongUse, which begins with `path`,
/// if it is empty or leads beyond them.
Result<TumRange> resolveRange(TumRange range, size_t total, const std::string& path, const std::string& what);

/// Opens a folder with calibration.txt (`fx fy cx cy width height depth_scale`) and associations.txt, or rgb.txt and
/// depth.txt. Frames carry the colour picture's stamp and depth in the project's unit (values it cannot hold become 0).
///
/// A calibration with fy < 0 (original ICL-NUIM: the camera's y points up) is served by reversing the rows of both
/// pictures, with fy = -fy and cy = height - 1 - cy: coordinates in the camera frame, and so the truth's poses, stay.
///
/// kUnreachable: folder or file missing. kBadData: calibration or list unreadable. kWrongUse: range outside the
/// sequence. Damaged or wrong-sized pictures are errors of next(), which name the file.
Result<std::unique_ptr<FrameSource>> openTum(const std::string& directory, TumRange range = {});

/// The same for pairs that are known already; `kind` is what the description calls the sequence.
Result<std::unique_ptr<FrameSource>> openTumPairs(const std::string& kind, const std::string& directory, TumRange range,
                                                  const TumCalibration& calibration, std::vector<TumPair> pairs);

}  // namespace comap
