// For builds without libopenni2-dev.
#include "edge_agent/capture/openni2.h"

namespace comap {
namespace {

Error absent() {
  return {ErrorCode::kUnreachable, "this build has no OpenNI2: libopenni2-dev was missing when it was configured"};
}

}  // namespace

bool hasOpenNi2() { return false; }
Result<OpenNi2Camera> openOpenNi2(const std::string& /*uri*/, const CameraConfig& /*config*/) { return absent(); }
Result<StreamOpener> openOpenNi2Stream(const std::string& /*uri*/, PictureKind /*kind*/,
                                       const CameraConfig& /*config*/) {
  return absent();
}
Result<std::unique_ptr<FrameSource>> openOniFile(const std::string& /*path*/, const CameraConfig& /*config*/) {
  return absent();
}
std::vector<std::string> openNi2Found() { return {}; }

}  // namespace comap
