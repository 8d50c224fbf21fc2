// The list of revoked keys while a program runs: what it may become, and what stays in force.
#include "protocol/link/revocations.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "tests/protocol/link/site_keys.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using News = Revocations::News;

std::string contentOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

class RevocationsTest : public testing::Test {
 protected:
  RevocationsTest() {
    for (const char* robot : {"a", "b"}) keys_.of(KeyRole::kRobot, robot);
  }
  // Twice: a list that changes between two looks is not judged.
  News look(Revocations& revocations) {
    const News first = revocations.look(), second = revocations.look();
    EXPECT_TRUE(first == News::kNone || second == News::kNone);
    return first == News::kNone ? second : first;
  }
  void put(const std::string& list) {
    std::ofstream(core_ + "/revoked.pem", std::ios::binary | std::ios::trunc) << list;
    fs::last_write_time(core_ + "/revoked.pem", next_time_ += std::chrono::seconds(1));
  }
  std::string revoke(const std::string& name) {
    EXPECT_TRUE(revokeParticipant(keys_.path(), name));
    return contentOf(keys_.path() + "/authority/revoked.pem");
  }

  SiteKeys keys_{"flat"};
  const std::string core_ = keys_.of(KeyRole::kCore, "core");
  const std::string before_ = contentOf(core_ + "/revoked.pem");
  std::string told_;
  fs::file_time_type next_time_ = fs::file_time_type::clock::now();
  Revocations core_looks_{core_, [this](const std::string& text) { told_ += text + "\n"; }};
};

TEST_F(RevocationsTest, ALongerListIsFollowed) {
  EXPECT_EQ(look(core_looks_), News::kNone);
  EXPECT_EQ(contentOf(core_looks_.list()), before_);
  put(revoke("a"));
  EXPECT_EQ(look(core_looks_), News::kChanged);
  EXPECT_THAT(told_, HasSubstr("lists 1 certificates more: joining anew"));
  const std::string both = revoke("b");
  put(both);
  EXPECT_EQ(look(core_looks_), News::kChanged);
  EXPECT_EQ(contentOf(core_looks_.list()), both);
  EXPECT_EQ(look(core_looks_), News::kNone);
  EXPECT_EQ(core_looks_.barred(), "");
}

TEST_F(RevocationsTest, AnOlderListLetsNobodyInAgain) {
  const std::string one = revoke("a"), both = revoke("b");
  put(both);
  ASSERT_EQ(look(core_looks_), News::kChanged);
  for (const auto& [older, lacks] :
       {std::pair(one, "lacks 1 certificates"), std::pair(before_, "lacks 2 certificates")}) {
    told_.clear();
    put(older);
    EXPECT_EQ(look(core_looks_), News::kNone);
    EXPECT_THAT(told_, HasSubstr("is older: " + core_ + "/revoked.pem " + lacks));
    EXPECT_THAT(told_, HasSubstr("the one before it stays in force"));
    EXPECT_EQ(contentOf(core_looks_.list()), both) << "what DDS is given, whatever the file says";
    told_.clear();
    EXPECT_EQ(look(core_looks_), News::kNone);
    EXPECT_EQ(told_, "") << "once";
  }
  put(both);
  EXPECT_EQ(look(core_looks_), News::kNone) << "nothing new";
}

TEST_F(RevocationsTest, WhoIsRevokedStaysSoUntilItHasAnotherKey) {
  const std::string own = keys_.path() + "-on-a";
  fs::copy(keys_.path() + "/a", own, fs::copy_options::recursive);
  std::string told;
  Revocations robot_looks(own, [&](const std::string& text) { told += text + "\n"; });
  const auto putThere = [&](const std::string& list) {
    std::ofstream(own + "/revoked.pem", std::ios::binary | std::ios::trunc) << list;
    fs::last_write_time(own + "/revoked.pem", next_time_ += std::chrono::seconds(1));
  };
  putThere(revoke("a"));
  EXPECT_EQ(look(robot_looks), News::kOwnKey);
  EXPECT_THAT(robot_looks.barred(), HasSubstr("revoked, says " + own + "/revoked.pem"));
  putThere(before_);
  EXPECT_EQ(look(robot_looks), News::kNone);
  EXPECT_THAT(robot_looks.barred(), HasSubstr("revoked"));
  EXPECT_THAT(told, HasSubstr("is older"));
  fs::remove_all(own);
  fs::copy(keys_.of(KeyRole::kRobot, "a"), own, fs::copy_options::recursive);
  EXPECT_EQ(look(robot_looks), News::kChanged);
  EXPECT_EQ(robot_looks.barred(), "");
  fs::remove_all(own);
}

TEST_F(RevocationsTest, AnotherAuthorityBeginsAnew) {
  put(revoke("a"));
  ASSERT_EQ(look(core_looks_), News::kChanged);
  SiteKeys other("flat");
  other.of(KeyRole::kRobot, "a");
  const std::string theirs = other.of(KeyRole::kCore, "core");
  ASSERT_TRUE(revokeParticipant(other.path(), "a"));
  const std::string list = contentOf(theirs + "/revoked.pem");
  put(list);
  EXPECT_EQ(look(core_looks_), News::kNone) << "its list alone is none";
  EXPECT_THAT(told_, HasSubstr("cannot be used: "));
  for (const auto& file : fs::directory_iterator(theirs))
    fs::copy_file(file, fs::path(core_) / file.path().filename(), fs::copy_options::overwrite_existing);
  put(list);
  EXPECT_EQ(look(core_looks_), News::kChanged);
  EXPECT_EQ(contentOf(core_looks_.list()), list);
}

TEST(OwnCertificate, ThatExpiresIsToldOnceAndANewOneIsFollowed) {
  SiteKeys keys("flat", validDays(-30, 90));
  const std::string own = keys.path() + "-on-core", own_certificate = own + "/certificate.pem";
  fs::copy(keys.of(KeyRole::kCore, "core", validDays(-1, 30)), own, fs::copy_options::recursive);
  std::string told;
  Revocations looks(own, [&](const std::string& text) { told += text + "\n"; });
  const std::time_t end = std::time(nullptr) + 30 * std::time_t{86400};
  EXPECT_EQ(looks.look(end - 86400), News::kNone);
  EXPECT_EQ(told, "");
  EXPECT_EQ(looks.look(end + 60), News::kNone) << "who is connected stays so";
  EXPECT_THAT(told, HasSubstr(own_certificate + ": expired on 20"));
  EXPECT_EQ(looks.barred(), "");
  told.clear();
  EXPECT_EQ(looks.look(end + 61), News::kNone);
  EXPECT_EQ(told, "") << "once";

  ASSERT_TRUE(revokeParticipant(keys.path(), "core"));
  const std::string anew = keys.of(KeyRole::kCore, "core", validDays(-1, 60));
  fs::copy_file(anew + "/certificate.pem", own_certificate, fs::copy_options::overwrite_existing);
  EXPECT_EQ(looks.look(end + 62), News::kNone) << "half of a folder";
  for (const auto& file : fs::directory_iterator(anew))
    fs::copy_file(file, fs::path(own) / file.path().filename(), fs::copy_options::overwrite_existing);
  EXPECT_EQ(looks.look(end + 63), News::kNone) << "may be under way yet";
  EXPECT_EQ(looks.look(end + 64), News::kChanged);
  EXPECT_THAT(told, HasSubstr(own_certificate + " is new, until 20"));
  EXPECT_EQ(looks.look(end + 65), News::kNone);
  fs::remove_all(own);
}

TEST(OwnCertificate, OfAnAuthorityThatExpiresSaysSo) {
  SiteKeys keys("flat");
  const std::string core = keys.of(KeyRole::kCore, "core");
  std::string told;
  Revocations looks(core, [&](const std::string& text) { told += text + "\n"; });
  EXPECT_EQ(looks.look(std::time(nullptr) + 31 * std::time_t{86400}), News::kNone);
  EXPECT_THAT(told, HasSubstr(core + "/authority.pem: expired on 20"));
}

TEST_F(RevocationsTest, WhatIsNoListChangesNothing) {
  for (const std::string& text : {std::string(), std::string("-----BEGIN X509 CRL-----\nhalf")}) {
    told_.clear();
    put(text);
    EXPECT_EQ(look(core_looks_), News::kNone);
    EXPECT_THAT(told_, HasSubstr("cannot be used: "));
    EXPECT_EQ(contentOf(core_looks_.list()), before_);
  }
  fs::remove(core_ + "/revoked.pem");
  EXPECT_EQ(look(core_looks_), News::kNone);
  EXPECT_EQ(contentOf(core_looks_.list()), before_);
}

}  // namespace
}  // namespace comap
