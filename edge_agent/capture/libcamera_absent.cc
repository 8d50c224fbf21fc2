// For builds without libcamera-dev.
#include "edge_agent/capture/libcamera.h"

namespace comap {

bool hasLibcamera() { return false; }
Result<std::unique_ptr<PictureStream>> openLibcamera(const std::string& /*id*/, const VideoWish& /*wish*/,
                                                     const VideoControls& /*controls*/) {
  return Error{ErrorCode::kUnreachable,
               "this build has no libcamera: libcamera-dev was missing when it was configured"};
}
std::vector<std::string> libcameraFound() { return {}; }

}  // namespace comap
