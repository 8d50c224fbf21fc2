// What a browser may ask about one keyframe: its pictures, and every verdict that it has part in.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fleet_tools/view/view_server.h"
#include "mapping_core/store/map_store.h"

namespace comap {

/// "ROBOT/SESSION/SEQUENCE" from a page; nothing if it is none.
std::optional<KeyframeId> parseKeyframeId(const std::string& text);

/// "/keyframe/ID": JSON with the verdicts. "/picture/ID/colour" and "/picture/ID/depth": JPEG; 404 without a store.
/// Depth from near (bright) to far (dark), black where there is none. `store` may be null.
ViewAnswer answerAboutKeyframe(const std::string& path, const MapStore* store,
                               const std::function<std::vector<MatchVerdict>(const KeyframeId&)>& verdicts_of);

}  // namespace comap
