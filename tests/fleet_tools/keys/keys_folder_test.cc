// The folder of a site's keys: what is made, what is never made over, and what revoking leaves.
#include "fleet_tools/keys/keys_folder.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>
#include <sstream>

#include "tests/protocol/link/site_keys.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

std::string contentOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

unsigned modeOf(const std::string& path) {
  struct stat status {};
  EXPECT_EQ(stat(path.c_str(), &status), 0) << path;
  return status.st_mode & 0777;
}

TEST(KeysFolder, WhatIsMadeWillDo) {
  SiteKeys keys("flat");
  EXPECT_EQ(*siteOfKeys(keys.path()), "flat");
  for (const auto& [role, name] :
       {std::pair(KeyRole::kCore, std::string("core")), std::pair(KeyRole::kRobot, std::string("a")),
        std::pair(KeyRole::kTool, std::string("eye"))}) {
    const auto owner = checkCredentials(credentialsIn(keys.of(role, name)), std::time(nullptr));
    ASSERT_TRUE(owner) << owner.error().text;
    EXPECT_EQ(owner->role, role);
    EXPECT_EQ(owner->name, name);
    EXPECT_EQ(owner->site, "flat");
  }
  EXPECT_THAT(*participantsIn(keys.path()), ElementsAre("a", "core", "eye"));
}

TEST(KeysFolder, PrivateKeysAreTheirOwnersAlone) {
  SiteKeys keys("flat");
  const std::string robot = keys.of(KeyRole::kRobot, "a");
  for (const std::string& key : {robot + "/key.pem", keys.path() + "/authority/key.pem"}) {
    EXPECT_EQ(modeOf(key), 0600u) << key;
    EXPECT_THAT(contentOf(key), HasSubstr("PRIVATE KEY"));
  }
  EXPECT_EQ(modeOf(robot), 0700u);
  for (const auto& entry : fs::directory_iterator(robot))
    EXPECT_EQ(contentOf(entry.path()).find("PRIVATE KEY") != std::string::npos, entry.path().filename() == "key.pem")
        << entry.path();
}

TEST(KeysFolder, NothingIsMadeOver) {
  SiteKeys keys("flat");
  const std::string key = keys.of(KeyRole::kRobot, "a") + "/key.pem", before = contentOf(key);
  const auto again = addParticipant(keys.path(), KeyRole::kRobot, "a", validDays(0, 1));
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::kWrongUse);
  EXPECT_THAT(again.error().text, HasSubstr("never overwritten"));
  EXPECT_FALSE(addParticipant(keys.path(), KeyRole::kTool, "a", validDays(0, 1))) << "one name, one key";
  EXPECT_EQ(contentOf(key), before);
  const std::string authority = contentOf(keys.path() + "/authority/key.pem");
  const auto init = makeKeysFolder(keys.path(), "flat", validDays(0, 1));
  ASSERT_FALSE(init);
  EXPECT_THAT(init.error().text, HasSubstr("not empty"));
  EXPECT_EQ(contentOf(keys.path() + "/authority/key.pem"), authority);
}

TEST(KeysFolder, RefusesNamesThatAreNone) {
  SiteKeys keys("flat");
  for (const char* name : {"", "..", "A", "a/b", "authority", "revoked"}) {
    const auto added = addParticipant(keys.path(), KeyRole::kRobot, name, validDays(0, 1));
    ASSERT_FALSE(added) << name;
    EXPECT_EQ(added.error().code, ErrorCode::kWrongUse);
    EXPECT_FALSE(revokeParticipant(keys.path(), name)) << name;
  }
  const auto none = addParticipant(keys.path() + "/nowhere", KeyRole::kRobot, "a", validDays(0, 1));
  ASSERT_FALSE(none);
  EXPECT_THAT(none.error().text, HasSubstr("'fleet keys init'"));
}

TEST(KeysFolder, RevokingCountsEverywhereAndFreesTheName) {
  SiteKeys keys("flat");
  const std::string core = keys.of(KeyRole::kCore, "core"),
                    first = contentOf(keys.of(KeyRole::kRobot, "a") + "/certificate.pem");
  keys.of(KeyRole::kRobot, "b");
  const auto others = revokeParticipant(keys.path(), "a");
  ASSERT_TRUE(others) << others.error().text;
  EXPECT_THAT(*others, ElementsAre(keys.path() + "/b", keys.path() + "/core"));
  EXPECT_FALSE(revokeParticipant(keys.path(), "a")) << "twice";
  // The old certificate, against the list that the core now has.
  const auto names = participantsIn(keys.path());
  ASSERT_EQ(names->size(), 3u);
  Credentials old = credentialsIn(keys.path() + "/" + names->back());
  EXPECT_EQ(contentOf(old.certificate), first);
  old.revoked = core + "/revoked.pem";
  EXPECT_THAT(factsOf(old, std::time(nullptr))->refusal, HasSubstr("revoked"));
  // A new one of the same name counts, and the others still do.
  keys.of(KeyRole::kRobot, "a");
  for (const char* name : {"a", "b", "core"})
    EXPECT_TRUE(checkCredentials(credentialsIn(keys.path() + "/" + name), std::time(nullptr))) << name;
  // Both stay revoked once a second one is.
  ASSERT_TRUE(revokeParticipant(keys.path(), "a"));
  EXPECT_THAT(factsOf(old, std::time(nullptr))->refusal, HasSubstr("revoked"));
}

TEST(KeysFolder, AKeyWhoseFolderIsGoneCanBeRevoked) {
  SiteKeys keys("flat");
  const std::string core = keys.of(KeyRole::kCore, "core"), stolen = keys.path() + "-stolen";
  keys.of(KeyRole::kRobot, "a-b");  // another, whose name begins alike
  fs::rename(keys.of(KeyRole::kRobot, "a"), stolen);
  const auto others = revokeParticipant(keys.path(), "a");
  ASSERT_TRUE(others) << others.error().text;
  EXPECT_THAT(*others, ElementsAre(keys.path() + "/a-b", core));
  Credentials old = credentialsIn(stolen);
  old.revoked = core + "/revoked.pem";
  const auto facts = factsOf(old, std::time(nullptr));
  EXPECT_TRUE(facts->revoked) << facts->refusal;
  EXPECT_EQ(facts->all_revoked, std::set<std::string>{facts->serial});
  EXPECT_TRUE(checkCredentials(credentialsIn(keys.path() + "/a-b"), std::time(nullptr)));
  EXPECT_FALSE(revokeParticipant(keys.path(), "a")) << "twice";
  fs::remove_all(stolen);
  // Of folders that older versions made there is no copy.
  fs::remove_all(keys.path() + "/authority/issued");
  fs::remove(keys.path() + "/a-b/certificate.pem");
  const auto lost = revokeParticipant(keys.path(), "a-b");
  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(lost.error().text, HasSubstr("a-b: its certificate.pem is gone"));
}

TEST(KeysFolder, AFolderIsMovedUnderTheSerialOfItsOwnCertificate) {
  SiteKeys keys("flat");
  for (int lost = 0; lost < 4; ++lost) fs::remove_all(keys.of(KeyRole::kRobot, "a"));
  const std::string own = keys.of(KeyRole::kRobot, "a"), core = keys.of(KeyRole::kCore, "core");
  const std::string serial = factsOf(credentialsIn(own), std::time(nullptr))->serial;
  // Of another robot, and no certificate: of no concern here.
  std::ofstream(keys.path() + "/authority/issued/a-b-1F.pem") << "nonsense";
  ASSERT_TRUE(revokeParticipant(keys.path(), "a"));
  EXPECT_THAT(*participantsIn(keys.path()), ElementsAre("core", "revoked/a-" + serial));
  EXPECT_EQ(factsOf(credentialsIn(core), std::time(nullptr))->all_revoked.size(), 5u) << "all that were ever made";
  // Brought back from somewhere.
  fs::copy(keys.path() + "/revoked/a-" + serial, own, fs::copy_options::recursive);
  const auto again = revokeParticipant(keys.path(), "a");
  ASSERT_FALSE(again);
  EXPECT_THAT(again.error().text, HasSubstr("/a: its certificate is revoked already"));
}

TEST(KeysFolder, AFolderThatCannotBeReadIsSaid) {
  SiteKeys keys("flat");
  const std::string loop = keys.path() + "/loop";
  fs::create_symlink(loop, loop);  // what asks for it throws, if it may
  for (const Error& error :
       {participantsIn(loop).error(), revokeParticipant(loop, "a").error(), siteOfKeys(loop).error(),
        addParticipant(loop, KeyRole::kRobot, "a", validDays(0, 1)).error(),
        makeKeysFolder(loop, "flat", validDays(0, 1)).error()})
    EXPECT_THAT(error.text, HasSubstr(loop));
}

}  // namespace
}  // namespace comap
