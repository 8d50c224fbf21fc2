// What an authority makes is what others can check; what it did not make is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/keys/authority.h"
#include "protocol/keys/signed_text.h"

namespace comap {
namespace {

using testing::HasSubstr;

Validity aYear() {
  const std::time_t now = std::time(nullptr);
  return {now - 3600, now + 365 * 86400};
}

Authority authority(const std::string& site = "flat") {
  auto made = Authority::create(site, aYear());
  EXPECT_TRUE(made);
  return *made;
}

TEST(Participant, NamesAreOfOneForm) {
  EXPECT_EQ(subjectText({"flat", KeyRole::kRobot, "a"}), "CN=a,OU=robot,O=flat");
  EXPECT_EQ(describe({"flat", KeyRole::kTool, "eye"}), "tool 'eye' of site 'flat'");
  for (const char* site : {"flat", "Site-2_b.x", "a"}) EXPECT_EQ(keySiteProblem(site), "") << site;
  for (const std::string& site : {std::string(), std::string("a,b"), std::string("a/b"), std::string("a b"),
                                  std::string("<x>"), std::string(65, 'a'), std::string("\xc3\xa4")})
    EXPECT_THAT(keySiteProblem(site), HasSubstr("keys need a name of 1-64 characters")) << site;
}

TEST(Participant, GuidsBeginWithTheSubjectsHash) {
  const auto a = guidStart({"flat", KeyRole::kRobot, "a"});
  EXPECT_EQ(a, guidStart({"flat", KeyRole::kRobot, "a"}));
  EXPECT_EQ(a[0] & 0x80, 0x80);
  EXPECT_NE(a, guidStart({"flat", KeyRole::kRobot, "b"}));
  EXPECT_NE(a, guidStart({"flat", KeyRole::kCore, "a"}));
  EXPECT_NE(a, guidStart({"house", KeyRole::kRobot, "a"}));
}

TEST(Authority, SignsWhatItsCertificateProves) {
  const Authority own = authority(), other = authority();
  const std::string document = "<dds>caf\xc3\xa9</dds>\n<second/>";
  const auto signed_text = own.sign(document);
  ASSERT_TRUE(signed_text);
  const auto back = verifySignedText(*signed_text, own.certificatePem(), "p");
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_THAT(*back, HasSubstr("<dds>caf\xc3\xa9</dds>"));
  EXPECT_THAT(*back, HasSubstr("<second/>"));
  EXPECT_FALSE(verifySignedText(*signed_text, other.certificatePem(), "p"));
  std::string forged = *signed_text;
  forged.replace(forged.find("second"), 6, "zecond");
  const auto refused = verifySignedText(forged, own.certificatePem(), "some/file");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("some/file: is not as the authority signed it"));
  EXPECT_FALSE(verifySignedText("", own.certificatePem(), "p"));
}

TEST(Authority, AKeyThatItIssuesSignsNothing) {
  const Authority own = authority();
  const auto issued = own.issue({"flat", KeyRole::kRobot, "a"}, aYear());
  ASSERT_TRUE(issued);
  const auto forged = signText("<dds/>", issued->certificate, issued->key);
  ASSERT_TRUE(forged) << forged.error().text;
  EXPECT_FALSE(verifySignedText(*forged, own.certificatePem(), "p"));
}

TEST(Authority, IsReadBackWhole) {
  const Authority own = authority("house"), other = authority("house");
  const auto read = Authority::fromPem(own.certificatePem(), own.keyPem());
  ASSERT_TRUE(read);
  EXPECT_EQ(read->site(), "house");
  EXPECT_FALSE(Authority::fromPem(own.certificatePem(), other.keyPem())) << "another's key";
  EXPECT_FALSE(Authority::fromPem("nonsense", own.keyPem()));
  const auto issued = own.issue({"house", KeyRole::kCore, "core"}, aYear());
  ASSERT_TRUE(issued);
  EXPECT_FALSE(Authority::fromPem(issued->certificate, issued->key)) << "a participant is no authority";
}

TEST(Authority, IssuesToItsSiteAndToNamesOnly) {
  const Authority own = authority();
  EXPECT_FALSE(own.issue({"house", KeyRole::kRobot, "a"}, aYear()));
  EXPECT_FALSE(own.issue({"flat", KeyRole::kRobot, "../a"}, aYear()));
  EXPECT_FALSE(Authority::create("a,O=b", aYear()));
}

}  // namespace
}  // namespace comap
