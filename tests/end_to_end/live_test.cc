// A running site as an observer hears it: `fleet watch`, and the tiles that `fleet view --live` asks for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <termios.h>

#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "fleet_tools/view/live_scene.h"
#include "fleet_tools/view/tile_message.h"
#include "fleet_tools/watch/observer_link.h"
#include "tests/end_to_end/background.h"
#include "tests/end_to_end/flat_test.h"

namespace comap {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

constexpr const char *kDomain = "187", *kTerminalDomain = "186", *kKeyedDomain = "185";

class Live : public FlatTest {
 protected:
  static nlohmann::json siteOf(const ViewFeed& feed) {
    FeedCursor cursor;
    for (FeedMessage message = feed.next(cursor); message.bytes; message = feed.next(cursor)) {
      if (message.binary) continue;
      const auto section = nlohmann::json::parse(message.bytes->begin() + kMessageHeadroom, message.bytes->end());
      if (section.at("section") == "site") return section;
    }
    return {};
  }
  static bool tilesCome(LiveScene& scene, ViewFeed& feed) {
    const auto until = std::chrono::steady_clock::now() + 90s;
    while (feed.tiles() < 20 && std::chrono::steady_clock::now() < until) {
      scene.hear(feed, 50ms);
      std::this_thread::sleep_for(50ms);
    }
    return feed.tiles() >= 20;
  }
  // The last thing that `fleet watch --json` told.
  static nlohmann::json lastOf(const ProgramRun& watched) {
    EXPECT_EQ(watched.exit_code, 0) << watched.err;
    std::istringstream lines(watched.out);
    nlohmann::json last;
    for (std::string line; std::getline(lines, line);) last = nlohmann::json::parse(line);
    return last;
  }
};

// `fleet watch` on a terminal of its own, whose screen is what it writes.
class Terminal {
 public:
  Terminal(const std::vector<std::string>& arguments, unsigned short columns, unsigned short rows) {
    winsize size{rows, columns, 0, 0};
    std::vector<std::string> words = {COMAP_BIN_DIR "/fleet"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    pid_ = forkpty(&master_, nullptr, nullptr, &size);
    if (pid_ == 0) {
      execv(argv[0], argv.data());
      _exit(127);
    }
    tcgetattr(master_, &before_);
  }
  ~Terminal() {
    if (!code_) kill(pid_, SIGKILL);
    if (!code_) waitpid(pid_, nullptr, 0);
    close(master_);
  }
  // What was written until `text` came, from the end of the last answer on; empty if it does not come.
  std::string until(const std::string& text) {
    const auto end = std::chrono::steady_clock::now() + 30s;
    while (std::chrono::steady_clock::now() < end) {
      if (const size_t at = seen_.find(text); at != std::string::npos) {
        const std::string part = seen_.substr(0, at + text.size());
        seen_.erase(0, part.size());
        return part;
      }
      pollfd readable{master_, POLLIN, 0};
      if (poll(&readable, 1, 200) != 1) continue;
      char bytes[4096];
      const ssize_t got = read(master_, bytes, sizeof bytes);
      if (got <= 0) break;
      seen_.append(bytes, size_t(got));
    }
    return {};
  }
  void resize(unsigned short columns, unsigned short rows) const {
    const winsize size{rows, columns, 0, 0};
    ASSERT_EQ(ioctl(master_, TIOCSWINSZ, &size), 0);
  }
  void press(char key) const { ASSERT_EQ(write(master_, &key, 1), 1); }
  int wait() {
    int status = 0;
    if (!code_ && waitpid(pid_, &status, 0) == pid_) code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 256;
    return code_.value_or(-1);
  }
  // Lines and echo as they were.
  bool restored() const {
    termios now{};
    return tcgetattr(master_, &now) == 0 && now.c_lflag == before_.c_lflag;
  }
  bool echoes() const {
    termios now{};
    return tcgetattr(master_, &now) == 0 && (now.c_lflag & ECHO) != 0;
  }

 private:
  int master_ = -1;
  pid_t pid_ = -1;
  termios before_{};
  std::string seen_;
  std::optional<int> code_;
};

std::vector<std::string> linesOf(std::string frame) {
  const size_t top = frame.rfind("\x1b[H");
  if (top != std::string::npos) frame.erase(0, top + 3);
  std::vector<std::string> lines;
  std::istringstream in(frame);
  for (std::string line; std::getline(in, line);) {
    line = line.substr(0, line.find("\x1b"));
    lines.push_back(line);
  }
  return lines;
}

constexpr const char *kEntered = "\x1b[?1049h\x1b[?25l", *kLeft = "\x1b[?25h\x1b[?1049l", *kDrawn = "\x1b[J";

TEST_F(Live, OnATerminalTheScreenFitsAndIsLeftAsItWas) {
  Background core("mapping_core", {"--store", folder_.path("watched.comap"), "--domain", kTerminalDomain},
                  folder_.path("core.log"));
  const std::vector<std::string> watch = {"watch", "--wait", "60", "--domain", kTerminalDomain};
  Terminal terminal(watch, 100, 30);
  ASSERT_NE(terminal.until(kEntered), "");
  EXPECT_FALSE(terminal.echoes());
  const std::string site = terminal.until("core: ");
  ASSERT_THAT(site, HasSubstr("site default; ")) << contentOf(folder_.path("core.log"));
  ASSERT_NE(terminal.until(kDrawn), "");
  terminal.resize(16, 3);
  std::vector<std::string> lines;
  for (int frame = 0; frame < 3; ++frame) lines = linesOf(terminal.until(kDrawn));  // one may be on its way
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0], "site default; c");
  for (const std::string& line : lines) EXPECT_LE(line.size(), 15u);
  terminal.press('x');
  terminal.press('q');
  EXPECT_NE(terminal.until(kLeft), "");
  EXPECT_EQ(terminal.wait(), 0);
  EXPECT_TRUE(terminal.restored());

  Terminal interrupted(watch, 80, 24);
  ASSERT_NE(interrupted.until(kDrawn), "");
  interrupted.press('\x03');
  EXPECT_NE(interrupted.until(kLeft), "");
  EXPECT_EQ(interrupted.wait(), 0);
  EXPECT_TRUE(interrupted.restored());
  EXPECT_EQ(core.end(SIGTERM), 0) << contentOf(folder_.path("core.log"));

  Terminal alone({"watch", "--wait", "3", "--domain", kTerminalDomain}, 80, 24);
  EXPECT_NE(alone.until("no core is heard"), "");
  EXPECT_NE(alone.until(kLeft), "");
  EXPECT_NE(alone.until("fleet: no mapping core of site 'default'"), "") << "told on the screen that stays";
  EXPECT_EQ(alone.wait(), 3);
  EXPECT_TRUE(alone.restored());
}

TEST_F(Live, ASiteIsWatchedAndItsTilesComeToAnObserver) {
  const ProgramRun nobody = runProgram("fleet watch --wait 1 --domain " + std::string(kDomain));
  EXPECT_EQ(nobody.exit_code, 3);
  EXPECT_THAT(nobody.err, HasSubstr("no mapping core of site 'default' on DDS domain 187 was heard for 1 s"));

  Background core("mapping_core", {"--store", folder_.path("live.comap"), "--domain", kDomain},
                  folder_.path("core.log"));
  Background robot("edge_agent",
                   {"--robot", "a", "--source", "tum:" + flat_ + "/a@0:40", "--domain", kDomain, "--outbox", "memory"},
                   folder_.path("a.log"));
  DdsLinkOptions options;
  options.domain = std::stoi(kDomain);
  options.role = LinkRole::kObserver;
  std::string name;
  auto link = connectObserver(options, true, name);
  ASSERT_TRUE(link) << link.error().text;
  LiveScene scene(std::move(*link), name, "default");
  ViewFeed feed;
  EXPECT_TRUE(tilesCome(scene, feed)) << contentOf(folder_.path("core.log")) << contentOf(folder_.path("a.log"));
  EXPECT_EQ(robot.wait(), 0) << contentOf(folder_.path("a.log")) << "nobody who watches holds a robot up";

  const nlohmann::json last = lastOf(runProgram("fleet watch --json --for 3 --domain " + std::string(kDomain)));
  ASSERT_TRUE(last.is_object());
  EXPECT_EQ(last.at("core_heard"), true);
  EXPECT_GT(last.at("core").at("keyframes").get<int>(), 0);
  EXPECT_TRUE(last.at("robots").contains("a"));

  scene.hear(feed, 50ms);
  scene.show(feed, nullptr);
  EXPECT_EQ(siteOf(feed).at("core_gone_ms"), 0);
  EXPECT_EQ(core.end(SIGTERM), 0) << contentOf(folder_.path("core.log"));
  for (int i = 0; i < 400 && siteOf(feed).at("core_heard"); ++i) {
    std::this_thread::sleep_for(50ms);
    scene.hear(feed, 50ms);
    scene.show(feed, nullptr);
  }
  EXPECT_EQ(siteOf(feed).at("core_heard"), false);
  EXPECT_GT(siteOf(feed).at("core_gone_ms").get<int64_t>(), 1'000'000'000'000) << "when it went is told";
}

TEST_F(Live, ASiteWithKeysIsWatchedByThoseWhoHaveOne) {
  const std::string keys = folder_.path("keys"), core_log = folder_.path("core.log"), robot_log = folder_.path("a.log");
  for (const std::string verb : {"init", "add-core", "add-robot", "add-tool"}) {
    const ProgramRun made = runProgram("fleet keys " + verb + " " + keys +
                                       (verb == "init"        ? " --site flat"
                                        : verb == "add-robot" ? " a"
                                                              : ""));
    ASSERT_EQ(made.exit_code, 0) << verb << ": " << made.err;
  }
  const auto on = [&](const std::string& who, std::vector<std::string> arguments) {
    for (const std::string& more : {std::string("--domain"), std::string(kKeyedDomain), std::string("--core-site"),
                                    std::string("flat"), std::string("--keys"), keys + "/" + who})
      arguments.push_back(more);
    return arguments;
  };
  Background core("mapping_core", on("core", {"--store", folder_.path("keyed.comap")}), core_log);
  Background robot("edge_agent",
                   on("a", {"--robot", "a", "--source", "tum:" + flat_ + "/a@0:40", "--outbox", "memory"}), robot_log);
  DdsLinkOptions options;
  options.domain = std::stoi(kKeyedDomain);
  options.site = "flat";
  options.role = LinkRole::kObserver;
  options.keys = keys + "/tool";
  std::string name;
  auto link = connectObserver(options, true, name);
  ASSERT_TRUE(link) << link.error().text;
  EXPECT_EQ(name, "tool") << "that of its certificate";
  LiveScene scene(std::move(*link), name, "flat");
  ViewFeed feed;
  EXPECT_TRUE(tilesCome(scene, feed)) << contentOf(core_log) << contentOf(robot_log);
  EXPECT_EQ(robot.wait(), 0) << contentOf(robot_log);

  const std::string watch = "fleet watch --json --domain " + std::string(kKeyedDomain) + " --site flat";
  const nlohmann::json last = lastOf(runProgram(watch + " --for 3 --keys " + keys + "/tool"));
  ASSERT_TRUE(last.is_object());
  EXPECT_EQ(last.at("core_heard"), true);
  EXPECT_GT(last.at("core").at("keyframes").get<int>(), 0);
  EXPECT_TRUE(last.at("robots").contains("a"));
  const ProgramRun outsider = runProgram(watch + " --wait 5");
  EXPECT_EQ(outsider.exit_code, 3) << outsider.out;
  EXPECT_THAT(outsider.err, HasSubstr("no mapping core of site 'flat'"));
  EXPECT_EQ(core.end(SIGTERM), 0) << contentOf(core_log);
  EXPECT_THAT(contentOf(core_log), HasSubstr("has no keys (link.keys) and was not let in"));
}

}  // namespace
}  // namespace comap
