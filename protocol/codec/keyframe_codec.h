// Keyframe <-> bytes: colour as JPEG, depth lossless, fern code packed.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "protocol/codec/colour_codec.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/keyframe_link.h"
#include "protocol/types/result.h"

namespace comap {

/// kWrongUse, naming the field, if a value breaks a limit or the images are not of the camera's size.
/// T_link_this and its information travel only if `linked`.
Result<std::vector<uint8_t>> encodeKeyframe(const Keyframe& keyframe, int jpeg_quality = kDefaultJpegQuality);
/// kBadData for damaged bytes, another protocol major, or a value beyond its limit.
Result<Keyframe> decodeKeyframe(std::span<const uint8_t> bytes);

/// As decodeKeyframe, but colour and depth are left empty and unchecked: about 0.2 ms.
Result<Keyframe> decodeKeyframeWithoutImages(std::span<const uint8_t> bytes);

/// The encoded keyframe with its colour packed more tightly, if that makes it smaller. kBadData as decodeKeyframe.
Result<std::vector<uint8_t>> thinColour(std::span<const uint8_t> bytes, int jpeg_quality);

/// The encoded keyframe tied to another one, with `skipped` sequences before it that never come. kBadData as
/// decodeKeyframe.
Result<std::vector<uint8_t>> relinkKeyframe(std::span<const uint8_t> bytes, const KeyframeLink& link, uint32_t skipped);

/// Which keyframe an encoded one is, and when it was taken.
struct KeyframeHead {
  KeyframeId id;
  int64_t stamp_ns = 0;
};

/// As decodeKeyframe, without looking at the images or anything behind them: about 0.1 ms.
Result<KeyframeHead> decodeKeyframeId(std::span<const uint8_t> bytes);

}  // namespace comap
