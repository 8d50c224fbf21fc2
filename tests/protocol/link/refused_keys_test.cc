// Keys that will not do are refused before anything is sent, in a sentence that says what to check.
#include <ifaddrs.h>
#include <net/if.h>

#include "protocol/keys/signed_text.h"
#include "tests/protocol/link/keyed_link.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

class RefusedKeys : public testing::Test {
 protected:
  // Robot a's keys after `damage` to its folder.
  void expectRefusal(const std::function<void(const std::string& folder)>& damage, ErrorCode code,
                     const testing::Matcher<std::string>& text) {
    const std::string folder = keys_.of(KeyRole::kRobot, "a");
    damage(folder);
    const auto link = connectDds(optionsOf(LinkRole::kRobot, "a", folder));
    ASSERT_FALSE(link);
    EXPECT_EQ(link.error().code, code) << link.error().text;
    EXPECT_THAT(link.error().text, text);
  }

  SiteKeys keys_{kSite};
};

TEST_F(RefusedKeys, NoSuchFolder) {
  expectRefusal([](const std::string& folder) { fs::remove_all(folder); }, ErrorCode::kUnreachable,
                HasSubstr("'fleet keys'"));
}

TEST_F(RefusedKeys, AFileIsMissing) {
  for (const char* name :
       {"authority.pem", "certificate.pem", "key.pem", "governance.p7s", "permissions.p7s", "revoked.pem"}) {
    const std::string folder = keys_.of(KeyRole::kRobot, "a");
    expectRefusal([&](const std::string&) { fs::remove(folder + "/" + name); }, ErrorCode::kUnreachable,
                  AllOf(HasSubstr(folder + "/" + name), HasSubstr("No such file")));
    fs::remove_all(folder);
  }
}

TEST_F(RefusedKeys, AFileIsNone) {
  for (const char* name :
       {"authority.pem", "certificate.pem", "key.pem", "governance.p7s", "permissions.p7s", "revoked.pem"}) {
    const std::string folder = keys_.of(KeyRole::kRobot, "a");
    expectRefusal([&](const std::string&) { overwrite(folder + "/" + name, "once upon a time"); }, ErrorCode::kBadData,
                  HasSubstr(folder + "/" + name + ": "));
    fs::remove_all(folder);
  }
}

TEST_F(RefusedKeys, TheKeyIsOpenToOthers) {
  expectRefusal([](const std::string& folder) { fs::permissions(folder + "/key.pem", fs::perms(0640)); },
                ErrorCode::kBadData, AllOf(HasSubstr("key.pem"), HasSubstr("chmod 600")));
}

TEST_F(RefusedKeys, TheKeyIsAnothers) {
  const std::string other = keys_.of(KeyRole::kRobot, "b");
  expectRefusal([&](const std::string& folder) { overwrite(folder + "/key.pem", contentOf(other + "/key.pem")); },
                ErrorCode::kBadData, HasSubstr("key.pem: not the key of"));
}

TEST_F(RefusedKeys, TheCertificateIsOfAnotherAuthority) {
  SiteKeys other(kSite);
  const std::string stranger = other.of(KeyRole::kRobot, "a");
  expectRefusal(
      [&](const std::string& folder) {
        overwrite(folder + "/certificate.pem", contentOf(stranger + "/certificate.pem"));
        overwrite(folder + "/key.pem", contentOf(stranger + "/key.pem"));
      },
      ErrorCode::kBadData, AllOf(HasSubstr("certificate.pem: the authority in"), HasSubstr("did not sign it")));
}

TEST_F(RefusedKeys, PermissionsWereEdited) {
  expectRefusal(
      [](const std::string& folder) { replaceIn(folder + "/permissions.p7s", "comap/v1/hello", "comap/v1/tiles"); },
      ErrorCode::kBadData,
      AllOf(HasSubstr("permissions.p7s: is not as the authority signed it"), HasSubstr("changed")));
}

TEST_F(RefusedKeys, GovernanceWasEdited) {
  expectRefusal([](const std::string& folder) { replaceIn(folder + "/governance.p7s", "ENCRYPT", "NONE"); },
                ErrorCode::kBadData, HasSubstr("governance.p7s: is not as the authority signed it"));
}

TEST_F(RefusedKeys, GovernanceOfAnotherVersion) {
  expectRefusal(
      [this](const std::string& folder) {
        const std::string authority = keys_.path() + "/authority/";
        const auto other = signText("<dds><domain_access_rules/></dds>", contentOf(authority + "authority.pem"),
                                    contentOf(authority + "key.pem"));
        ASSERT_TRUE(other) << other.error().text;
        overwrite(folder + "/governance.p7s", *other);
      },
      ErrorCode::kBadData, AllOf(HasSubstr("governance.p7s: asks for other protection"), HasSubstr("'fleet keys'")));
}

// The robot's certificate comes from the authority too: it must not be able to sign its own permissions.
TEST_F(RefusedKeys, PermissionsThatTheRobotSignedItself) {
  expectRefusal(
      [](const std::string& folder) {
        const auto permissions =
            verifySignedText(contentOf(folder + "/permissions.p7s"), contentOf(folder + "/authority.pem"), "p");
        ASSERT_TRUE(permissions);
        const auto own = signText(*permissions, contentOf(folder + "/certificate.pem"), contentOf(folder + "/key.pem"));
        ASSERT_TRUE(own) << own.error().text;
        overwrite(folder + "/permissions.p7s", *own);
      },
      ErrorCode::kBadData, HasSubstr("permissions.p7s: is not as the authority signed it"));
}

TEST_F(RefusedKeys, PermissionsOfAnotherRobot) {
  const std::string other = keys_.of(KeyRole::kRobot, "b");
  expectRefusal(
      [&](const std::string& folder) { overwrite(folder + "/permissions.p7s", contentOf(other + "/permissions.p7s")); },
      ErrorCode::kBadData, HasSubstr("permissions.p7s: grants nothing to robot 'a' of site 'keyed'"));
}

TEST_F(RefusedKeys, ExpiredNotYetValidAndRevoked) {
  keys_.of(KeyRole::kRobot, "a", validDays(-20, -10));
  expectRefusal([](const std::string&) {}, ErrorCode::kBadData,
                AllOf(HasSubstr("certificate.pem: expired on 20"), HasSubstr("'fleet keys'")));
  fs::remove_all(keys_.path() + "/a");
  keys_.of(KeyRole::kRobot, "a", validDays(10, 20));
  expectRefusal([](const std::string&) {}, ErrorCode::kBadData,
                AllOf(HasSubstr("certificate.pem: not valid before 20"), HasSubstr("clock")));
  fs::remove_all(keys_.path() + "/a");
  keys_.of(KeyRole::kRobot, "a");
  ASSERT_TRUE(revokeParticipant(keys_.path(), "a"));
  for (const auto& entry : fs::directory_iterator(keys_.path() + "/revoked"))
    fs::rename(entry.path(), keys_.path() + "/a");
  expectRefusal([](const std::string&) {}, ErrorCode::kBadData, HasSubstr("certificate.pem: revoked"));
}

TEST_F(RefusedKeys, OfAnotherRoleRobotOrSite) {
  const std::string robot = keys_.of(KeyRole::kRobot, "a"), core = keys_.of(KeyRole::kCore, "core");
  const auto refusal = [](const DdsLinkOptions& options) {
    const auto link = connectDds(options);
    EXPECT_FALSE(link);
    return link ? std::string() : link.error().text;
  };
  EXPECT_THAT(refusal(optionsOf(LinkRole::kCore, "", robot)),
              HasSubstr("is of robot 'a' of site 'keyed', this is a core"));
  EXPECT_THAT(refusal(optionsOf(LinkRole::kRobot, "a", core)), HasSubstr("is of core 'core' of site 'keyed'"));
  EXPECT_THAT(refusal(optionsOf(LinkRole::kRobot, "b", robot)), HasSubstr("this robot is 'b'"));
  EXPECT_THAT(refusal(optionsOf(LinkRole::kObserver, "", robot)), HasSubstr("this is a tool"));
  DdsLinkOptions elsewhere = optionsOf(LinkRole::kRobot, "a", robot);
  elsewhere.site = "other";
  EXPECT_THAT(refusal(elsewhere), HasSubstr("but link.site is 'other'"));
}

TEST(KeyedLink, LeavesTheMachineOnlyWithKeysOrTheWord) {
  ifaddrs* interfaces = nullptr;
  ASSERT_EQ(getifaddrs(&interfaces), 0);
  std::string name;
  for (const ifaddrs* one = interfaces; one != nullptr; one = one->ifa_next)
    if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET && (one->ifa_flags & IFF_LOOPBACK) == 0)
      name = one->ifa_name;
  freeifaddrs(interfaces);
  if (!name.empty()) {
    const auto link = connectDds({testDomain(), kSite, LinkRole::kCore, "", name});
    ASSERT_FALSE(link) << name << " was opened in clear text";
    EXPECT_EQ(link.error().code, ErrorCode::kWrongUse);
    EXPECT_THAT(link.error().text, AllOf(HasSubstr("'fleet keys'"), HasSubstr("--insecure")));
    return;
  }
  GTEST_SKIP() << "no network interface besides loopback";
}

}  // namespace
}  // namespace comap
