#include <signal.h>
#include <unistd.h>

#include <cstdio>
#include <memory>
#include <optional>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/watch/observer_link.h"
#include "fleet_tools/watch/site_watch.h"
#include "fleet_tools/watch/terminal_screen.h"
#include "fleet_tools/watch/watch_screen.h"

namespace comap {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kSecond(1000), kTurn(100);

volatile sig_atomic_t g_stop = 0;

struct WatchOptions {
  DdsLinkOptions link;
  bool json = false;
  double wait_s = 15, for_s = 0;
};

// Listens for a while, less if somebody wants to see or to end something. The core counts as heard when its topics are
// matched; that of a robot alone is none.
void listen(Link& link, SiteWatch& watch, milliseconds period, TerminalScreen* screen) {
  const auto until = WatchClock::now() + period;
  for (auto now = WatchClock::now(); now < until && g_stop == 0; now = WatchClock::now()) {
    const auto left = std::chrono::duration_cast<milliseconds>(until - now);
    if (const auto delivery = link.receive(std::min(left, kTurn))) watch.take(*delivery, WatchClock::now());
    if (screen == nullptr) continue;
    if (screen->quitAsked()) g_stop = 1;
    if (screen->resized()) return;
  }
}

void tell(const WatchOptions& options, const SiteWatch& watch, bool core_there, TerminalScreen* screen) {
  const auto now = WatchClock::now();
  if (screen != nullptr) {
    screen->draw(watchScreen(watch, options.link.site, core_there, now));
    return;
  }
  if (options.json) {
    const auto text = watchJson(watch, options.link.site, core_there, now)
                          .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    std::printf("%s\n", text.c_str());
  } else {
    std::printf("%s\n", watchLine(watch, core_there, now).c_str());
  }
  std::fflush(stdout);
}

int run(const WatchOptions& options) {
  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGHUP, &action, nullptr);
  std::string name;
  const auto link = connectObserver(options.link, false, name);
  if (!link) return failWith(link.error());
  std::optional<TerminalScreen> screen;
  if (!options.json && isatty(STDOUT_FILENO) == 1) screen.emplace();
  SiteWatch watch;
  const auto start = WatchClock::now();
  auto core_last = start;
  bool ever = false;
  while (g_stop == 0) {
    listen(**link, watch, kSecond, screen ? &*screen : nullptr);
    const bool core_there = (*link)->peers() > 0;
    const auto now = WatchClock::now();
    if (core_there) core_last = now;
    ever = ever || core_there;
    const std::chrono::duration<double> without = now - core_last;
    if (without.count() > options.wait_s) {
      screen.reset();
      return failWith({ErrorCode::kUnreachable,
                       "no mapping core of site '" + options.link.site + "' on DDS domain " +
                           std::to_string(options.link.domain) + " was heard for " + fixed(options.wait_s, 0) + " s" +
                           (ever ? "; it was there before" : "; is it running, with this --site and --domain?")});
    }
    if (g_stop == 0 && (core_there || screen)) tell(options, watch, core_there, screen ? &*screen : nullptr);
    if (options.for_s > 0 && std::chrono::duration<double>(now - start).count() >= options.for_s) break;
  }
  if (ever || g_stop != 0) return 0;
  screen.reset();
  return failWith({ErrorCode::kUnreachable, "no mapping core of site '" + options.link.site + "' on DDS domain " +
                                                std::to_string(options.link.domain) + " was heard within the " +
                                                fixed(options.for_s, 0) + " s of --for"});
}

}  // namespace

void addWatchVerb(CLI::App& app, int& exit_code) {
  auto* verb =
      app.add_subcommand("watch", "A running site at a glance: robots, tracking, queues, maps, merges, verdicts");
  verb->footer(
      "Redraws in place on a terminal, writes a line a second into a pipe; ends with q or Ctrl-C. Exit code 3 if no\n"
      "core is heard for --wait seconds, or within the whole of --for. SENT counts keyframes that the core has "
      "acknowledged; bytes are not told to "
      "observers.\n"
      "Example: fleet watch --site flat");
  auto options = std::make_shared<WatchOptions>();
  addObserverOptions(*verb, options->link);
  verb->add_flag("--json", options->json, "One JSON document a line, one line a second");
  verb->add_option("--wait", options->wait_s, "Seconds without a core after which it ends")
      ->check(CLI::Range(1.0, 1e6))
      ->capture_default_str();
  verb->add_option("--for", options->for_s, "End after so many seconds; by default never")->check(CLI::Range(1.0, 1e9));
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
