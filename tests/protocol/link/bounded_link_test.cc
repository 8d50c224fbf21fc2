// Links that close, and one that never does.
#include "protocol/link/bounded_link.h"

#include <gmock/gmock.h>

#include <atomic>
#include <thread>

namespace comap {
namespace {

using namespace std::chrono_literals;

class FakeLink : public Link {
 public:
  FakeLink(std::atomic<bool>& may_close, std::atomic<bool>& closed) : may_close_(may_close), closed_(closed) {}
  ~FakeLink() override {
    while (!may_close_) std::this_thread::sleep_for(1ms);
    closed_ = true;
  }
  Result<void> publish(Topic, const std::string&, std::span<const uint8_t>) override { return {}; }
  bool delivered(Topic, const std::string&) const override { return true; }
  std::optional<Delivery> receive(std::chrono::milliseconds) override { return std::nullopt; }
  int peers() const override { return 3; }
  std::string trouble() const override { return "some"; }

 private:
  std::atomic<bool>& may_close_;
  std::atomic<bool>& closed_;
};

TEST(BoundedLink, ClosesBeforeItsOwnerGoesOn) {
  std::atomic<bool> may_close = true, closed = false;
  std::string told;
  {
    const BoundedLink link(std::make_shared<FakeLink>(may_close, closed), 60s,
                           [&](const std::string& text) { told = text; });
    EXPECT_EQ(link.peers(), 3);
    EXPECT_EQ(link.trouble(), "some");
  }
  EXPECT_TRUE(closed);
  EXPECT_EQ(told, "");
}

// In a process of its own, that must end although the link and a destructor at exit never do.
void giveUpAndExit() {
  static std::atomic<bool> may_close = false, closed = false;
  static const struct Lock {
    ~Lock() {
      while (!may_close) std::this_thread::sleep_for(1ms);
    }
  } library;
  {
    const BoundedLink link(std::make_shared<FakeLink>(may_close, closed), 1s,
                           [](const std::string& text) { std::fprintf(stderr, "told: %s\n", text.c_str()); });
  }
  std::exit(closed ? 1 : 7);
}

TEST(BoundedLinkDeathTest, OneThatDoesNotCloseIsGivenUpAndTheProgramEndsAsItWould) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(giveUpAndExit(), testing::ExitedWithCode(7), "told: the link does not close within 1 s");
}

}  // namespace
}  // namespace comap
