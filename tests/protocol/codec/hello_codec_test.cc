#include "protocol/codec/hello_codec.h"

#include <gmock/gmock.h>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

using testing::HasSubstr;

TEST(HelloCodec, RoundTrip) {
  samples::Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Hello hello{samples::robot(random), random(), random(), "0.1.0 \xc3\xa4"};
    const auto bytes = encodeHello(hello);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeHello(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->robot, hello.robot);
    EXPECT_EQ(back->session, hello.session);
    EXPECT_EQ(back->fern_book_hash, hello.fern_book_hash);
    EXPECT_EQ(back->version, hello.version);
  }
}

TEST(HelloCodec, RefusesBadNamesAndTexts) {
  for (const std::string& name : {std::string(), std::string("Robot"), std::string("a b"), std::string(33, 'a'),
                                  std::string(100000, 'a'), std::string("a\0b", 3)}) {
    const auto bytes = encodeHello({name, 1, 2, "1"});
    ASSERT_FALSE(bytes);
    EXPECT_EQ(bytes.error().code, ErrorCode::kWrongUse);
    EXPECT_THAT(bytes.error().text, HasSubstr("hello: robot"));
    EXPECT_LT(bytes.error().text.size(), 200u);
  }
  for (const std::string& text :
       {std::string(2000, 'v'), std::string("\n"), std::string("\x1b[2J"), std::string("\xff"), std::string("\xc0\xaf"),
        std::string("\xed\xa0\x80"), std::string("\xe2\x82"), std::string("\x7f")}) {
    const auto bytes = encodeHello({"a", 1, 2, text});
    ASSERT_FALSE(bytes) << text;
    EXPECT_THAT(bytes.error().text, HasSubstr("hello: version"));
  }
}

TEST(HelloCodec, SurvivesHostileBytes) {
  samples::Random random(2);
  const auto bytes = encodeHello({"r1", 0x1122334455667788, 0x99, "0.1.0"});
  ASSERT_TRUE(bytes);
  samples::abuse(random, *bytes, [](auto bad) {
    const auto hello = decodeHello(bad);
    return hello ? robotNameProblem(hello->robot).empty() : false;
  });
  // Without its name a hello is none; so no prefix shorter than that passes.
  for (size_t length = 0; length < 6; ++length) EXPECT_FALSE(decodeHello(std::span(*bytes).first(length)));
}

TEST(HelloCodec, RefusesMoreThanALimitOfBytes) {
  const std::vector<uint8_t> huge(kMaxSmallMessageBytes + 1, 0);
  const auto hello = decodeHello(huge);
  ASSERT_FALSE(hello);
  EXPECT_THAT(hello.error().text, HasSubstr("expected at most"));
}

}  // namespace
}  // namespace comap
