#include "protocol/codec/hello_codec.h"

#include "comap/v1/hello.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/limits.h"

namespace comap {
namespace {

codec::Check check(const Hello& hello) {
  return codec::Check("hello").robot("robot", hello.robot).text("version", hello.version);
}

}  // namespace

Result<std::vector<uint8_t>> encodeHello(const Hello& hello) {
  if (const auto checked = check(hello); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::Hello message;
  message.set_robot(hello.robot);
  message.set_session(hello.session);
  message.set_fern_book_hash(hello.fern_book_hash);
  message.set_version(hello.version);
  return codec::serialise(message, "hello", kMaxSmallMessageBytes);
}

Result<Hello> decodeHello(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Hello>(bytes, "hello", kMaxSmallMessageBytes);
  if (!message) return message.error();
  const Hello hello{message->robot(), message->session(), message->fern_book_hash(), message->version()};
  if (const auto checked = check(hello); !checked.ok()) return checked.error(ErrorCode::kBadData);
  return hello;
}

}  // namespace comap
