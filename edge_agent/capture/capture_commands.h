// What the command line does with a source besides tracking it.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "edge_agent/capture/capture_log.h"
#include "edge_agent/capture/frame_source.h"

namespace comap {

/// Prints the kinds of sources and the cameras that are plugged in to stdout.
void listSources();

/// Writes one frame, colour on the left and depth on the right (near red, far blue, none black), as PNG. Of a camera
/// it is the tenth frame, when its exposure has settled. kUnreachable if none comes within 10 s, or FILE cannot be
/// written.
Result<void> preview(FrameSource& source, const std::string& file, const CaptureLog& log);

/// Compares the edges of colour and depth over ten frames (of a camera once its exposure has settled), tells by how
/// many pixels they are apart, and writes the last of them with its depth edges drawn on it as PNG. kProblem if they
/// are more than 1.5 pixels apart, or the view shows too few edges to tell; else as preview.
Result<void> checkCalibration(FrameSource& source, const std::string& file, const CaptureLog& log);

/// Writes frames as a TUM-format folder until the source ends, there are `most` of them (0 = no limit), or `stop` says
/// so. Damaged frames are told and left out. kWrongUse if the folder is not empty, kUnreachable if no frame came; else
/// as TumWriter.
Result<void> record(FrameSource& source, const std::string& directory, size_t most, const std::function<bool()>& stop,
                    const CaptureLog& log);

}  // namespace comap
