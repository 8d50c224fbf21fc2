// Structs to bytes and back. Every struct of protocol/types that travels has encodeX and decodeX:
//   encodeX: kWrongUse if the value breaks a limit; whatever it gives, decodeX takes.
//   decodeX: kBadData for bytes that are damaged, of another protocol major, or beyond a limit (limits.h).
// Both are pure functions and may be called from any thread. No Protobuf header is needed to use them.
#pragma once

#include "protocol/codec/acknowledgement_codec.h"
#include "protocol/codec/colour_codec.h"
#include "protocol/codec/core_status_codec.h"
#include "protocol/codec/correction_codec.h"
#include "protocol/codec/depth_codec.h"
#include "protocol/codec/hello_codec.h"
#include "protocol/codec/interest_codec.h"
#include "protocol/codec/keyframe_codec.h"
#include "protocol/codec/limits.h"
#include "protocol/codec/match_verdict_codec.h"
#include "protocol/codec/merge_record_codec.h"
#include "protocol/codec/status_codec.h"
#include "protocol/codec/tile_codec.h"
#include "protocol/codec/version.h"
