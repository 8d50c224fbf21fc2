// Keys that are revoked while links are open.
#include "tests/protocol/link/keyed_link.h"

namespace comap {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using testing::AllOf;
using testing::HasSubstr;

// A core with robots a and b connected; a's folder is on a's machine, where nobody brings the new list.
class RevokedWhileConnected : public KeyedPeers {
 protected:
  RevokedWhileConnected() {
    keys_.of(KeyRole::kCore, "core");
    keys_.of(KeyRole::kRobot, "b");
    fs::copy(keys_.of(KeyRole::kRobot, "a"), on_a_, fs::copy_options::recursive);
    DdsLinkOptions core_options = core(), robot_options = optionsOf(LinkRole::kRobot, "a", on_a_);
    core_options.notice = core_told_.sink();
    robot_options.notice = robot_told_.sink();
    core_ = open(core_options);
    a_ = open(robot_options);
    b_ = open(robot("b"));
  }
  ~RevokedWhileConnected() override { fs::remove_all(on_a_); }
  // Says it again until the core hears it; whether it does.
  bool hears(Link& robot, const std::string& name, std::chrono::milliseconds limit) {
    for (const auto until = std::chrono::steady_clock::now() + limit; std::chrono::steady_clock::now() < until;) {
      static_cast<void>(bool(robot.publish(Topic::kStatus, name, std::vector<uint8_t>{1})));
      if (const auto got = core_->receive(100ms); got && got->robot == name) return true;
    }
    return false;
  }
  // Whether the core says so, in what it says after the first `after` characters.
  bool coreTells(const std::string& part, size_t after = 0) {
    const bool told = core_told_.awaits(part, after, [&] { static_cast<void>(core_->receive(50ms)); });
    EXPECT_TRUE(told) << core_told_.text();
    return told;
  }
  std::string listOfCore() const { return keys_.path() + "/core/revoked.pem"; }

  const std::string on_a_ = keys_.path() + "-a";
  Notices core_told_, robot_told_;
  std::unique_ptr<Link> core_, a_, b_;
};

TEST_F(RevokedWhileConnected, ARobotIsShutOutOfTheRunningCoreAndOthersStay) {
  ASSERT_TRUE(hears(*a_, "a", 20s) && hears(*b_, "b", 20s));
  const std::string before = contentOf(listOfCore());
  ASSERT_TRUE(revokeParticipant(keys_.path(), "a"));
  ASSERT_TRUE(coreTells(listOfCore() + " lists 1 certificates more: joining anew"));
  EXPECT_TRUE(hears(*b_, "b", 20s)) << "who is not revoked is let in again";
  EXPECT_FALSE(hears(*a_, "a", 3s));
  EXPECT_TRUE(coreTells("comap/robot/a was not let in: its certificate is revoked"));
  EXPECT_TRUE(waitForPeers(*a_, 0));
  EXPECT_TRUE(waitForPeers(*b_, 1));
  // The list as it was before lets nobody in again.
  overwrite(listOfCore(), before);
  EXPECT_TRUE(coreTells("is older: " + listOfCore() + " lacks 1 certificates"));
  EXPECT_TRUE(hears(*b_, "b", 20s));
  EXPECT_FALSE(hears(*a_, "a", 1s));
}

TEST_F(RevokedWhileConnected, ARobotThatGetsTheListStopsByItself) {
  ASSERT_TRUE(hears(*a_, "a", 20s));
  ASSERT_TRUE(revokeParticipant(keys_.path(), "a"));
  const std::string list = contentOf(listOfCore());
  overwrite(on_a_ + "/revoked.pem", list);
  for (int i = 0; i < 400 && a_->trouble().empty(); ++i) {
    static_cast<void>(a_->receive(50ms));
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_THAT(a_->trouble(), AllOf(HasSubstr(on_a_ + "/certificate.pem: revoked, says "),
                                   HasSubstr("nothing is sent or received with it any more")));
  EXPECT_EQ(a_->peers(), 0);
  const auto said = a_->publish(Topic::kStatus, "a", std::vector<uint8_t>{1});
  ASSERT_FALSE(said);
  EXPECT_EQ(said.error().code, ErrorCode::kUnreachable);
  EXPECT_EQ(said.error().text, a_->trouble());
  EXPECT_TRUE(robot_told_.awaits("revoked, says")) << robot_told_.text();
  // New keys of the same name in the same folder bring it back.
  fs::remove_all(on_a_);
  fs::copy(keys_.of(KeyRole::kRobot, "a"), on_a_, fs::copy_options::recursive);
  EXPECT_TRUE(hears(*a_, "a", 20s)) << robot_told_.text() << core_told_.text();
}

TEST_F(RevokedWhileConnected, AListThatCannotBeUsedChangesNothing) {
  ASSERT_TRUE(hears(*a_, "a", 20s));
  const SiteKeys other(kSite);
  for (const std::string& list :
       {std::string("-----BEGIN X509 CRL-----\nhalf"), contentOf(other.path() + "/authority/revoked.pem")}) {
    const size_t before = core_told_.text().size();
    overwrite(listOfCore(), list);
    EXPECT_TRUE(coreTells("cannot be used: ", before));
    EXPECT_THAT(core_told_.text().substr(before),
                AllOf(HasSubstr(listOfCore()), HasSubstr("the one before it stays in force")));
    EXPECT_TRUE(hears(*a_, "a", 20s));
  }
  EXPECT_EQ(core_told_.text().find("joining anew"), std::string::npos) << core_told_.text();
}

}  // namespace
}  // namespace comap
