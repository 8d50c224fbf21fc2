// The code of a place.
#include "comap/v1/common.pb.h"
#include "protocol/codec/fern_code_codec.h"
#include "tests/fuzz/fuzz.h"

using namespace comap;

COMAP_FUZZ_TARGET(bytes) {
  v1::FernCode message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return;
  const auto code = codec::readFernCode(message, "code");
  if (!code) return;
  v1::FernCode again;
  fuzz::require(bool(codec::write(*code, &again, "code")), "what was read can be written");
  const auto reread = codec::readFernCode(again, "code");
  fuzz::require(reread && *reread == *code, "a code stays what it is");
}
