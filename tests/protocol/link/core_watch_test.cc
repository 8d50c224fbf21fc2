// Two cores of one site: which of them stays.
#include "protocol/link/core_watch.h"

#include <gtest/gtest.h>

#include "tests/protocol/link/keyed_link.h"

namespace comap {
namespace {

const std::string kEarly = "00000000000000010000aaaa", kLate = "ffffffffffffffff0000bbbb";

TEST(CoreRank, OneStaysAndAllAgreeWhich) {
  const CoreRank early{false, kEarly}, late{false, kLate}, early_serves{true, kEarly}, late_serves{true, kLate};
  const CoreRank of_old = rankOf("");
  const std::vector<CoreRank> in_order = {of_old, early_serves, late_serves, early, late};
  for (size_t a = 0; a < in_order.size(); ++a)
    for (size_t b = 0; b < in_order.size(); ++b) EXPECT_EQ(staysBefore(in_order[a], in_order[b]), a < b) << a << b;
}

TEST(CoreRank, IsReadAsItIsTold) {
  const CoreRank now = newCoreRank();
  EXPECT_TRUE(staysBefore(now, {false, kLate}));
  EXPECT_TRUE(staysBefore({false, kEarly}, now));
  for (const bool serves : {true, false}) {
    const CoreRank back = rankOf(textOf({serves, now.began}));
    EXPECT_EQ(back.serves, serves);
    EXPECT_EQ(back.began, now.began);
  }
  for (const std::string text : {"", "serves ", "listens", "listens x", "serves 00000000000000010000aaaaa", "SERVES"}) {
    EXPECT_TRUE(rankOf(text).serves) << text;
    EXPECT_EQ(rankOf(text).began, "") << text;
  }
}

bool awaitElder(const Link& link) {
  for (const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
       link.elder().empty() && std::chrono::steady_clock::now() < until;)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return !link.elder().empty();
}

class TwoCores : public KeyedPeers, public testing::WithParamInterface<bool> {
 protected:
  std::unique_ptr<Link> openCore(const std::string& began, const std::string& site = kSite) {
    DdsLinkOptions options = core();
    if (!GetParam()) options.keys = "";
    options.site = site;
    options.began = began;
    return open(options);
  }
};

TEST_P(TwoCores, TheLaterOneGivesWayAndTheOtherDoesNot) {
  const auto late = openCore(kLate), early = openCore(kEarly);
  ASSERT_TRUE(late && early);
  EXPECT_TRUE(awaitElder(*late));
  EXPECT_NE(late->elder().find("another mapping core, there since 1970-01-01 00:00:00 UTC"), std::string::npos)
      << late->elder();
  EXPECT_EQ(early->elder(), "");
}

// Clocks of two machines may differ: who serves already is not pushed out by who has just begun.
TEST_P(TwoCores, WhoServesStays) {
  const auto serving = openCore(kLate);
  ASSERT_TRUE(serving);
  serving->serve();
  auto beginner = openCore(kEarly);
  ASSERT_TRUE(beginner);
  EXPECT_TRUE(awaitElder(*beginner));
  EXPECT_EQ(serving->elder(), "");
  // If both have begun to serve before they saw each other, the one that began earlier stays.
  beginner->serve();
  EXPECT_TRUE(awaitElder(*serving));
  EXPECT_EQ(beginner->elder(), "");
  beginner.reset();
  for (const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
       !serving->elder().empty() && std::chrono::steady_clock::now() < until;)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(serving->elder(), "") << "it is gone";
}

INSTANTIATE_TEST_SUITE_P(Keys, TwoCores, testing::Bool(),
                         [](const auto& keyed) { return keyed.param ? "WithKeys" : "InTheClear"; });

TEST_F(KeyedPeers, CoresOfOtherSitesAreNoRivals) {
  DdsLinkOptions here = core(), there = core();
  here.keys = there.keys = "";
  there.site = "elsewhere";
  here.began = kLate;
  there.began = kEarly;
  const auto link = open(here), other = open(there), second = open(here);
  ASSERT_TRUE(link && other && second);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  EXPECT_EQ(link->elder(), "") << "the third is this core itself, as far as it tells";
}

}  // namespace
}  // namespace comap
