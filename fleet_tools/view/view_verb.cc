#include <signal.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/view/keyframe_answers.h"
#include "fleet_tools/view/live_scene.h"
#include "fleet_tools/view/store_scene.h"
#include "fleet_tools/view/view_server.h"
#include "fleet_tools/watch/observer_link.h"

namespace comap {
namespace {

constexpr std::chrono::milliseconds kTurn(100), kHearing(60);
constexpr std::chrono::seconds kStoreLook(2);
constexpr int kTurnsPerShow = 3;

volatile sig_atomic_t g_stop = 0;

struct ViewOptions {
  std::string store;
  bool live = false;
  DdsLinkOptions link;
  ViewServerOptions server;
};

// A store, a running site, or both: then keyframes and matches are the store's, tiles and robots are heard.
class Scenes {
 public:
  Result<void> open(const ViewOptions& options) {
    if (!options.store.empty()) {
      awaited_ = options.store;
      std::error_code none;
      if (options.live && !std::filesystem::exists(awaited_, none))
        std::fprintf(stderr, "fleet: %s: is not there yet; it is shown as soon as a core has made it\n",
                     awaited_.c_str());
      else if (const auto read = openStore(!options.live); !read)
        return read.error();
    }
    if (!options.live) return {};
    std::string name;
    auto link = connectObserver(options.link, true, name);
    if (!link) return link.error();
    live_.emplace(std::move(*link), name, options.link.site);
    live_->show(feed_, store_ ? &*store_ : nullptr);
    return {};
  }

  // Called ten times a second.
  void follow() {
    bool changed = false;
    if ((store_ || !awaited_.empty()) && std::chrono::steady_clock::now() - looked_ >= kStoreLook) {
      looked_ = std::chrono::steady_clock::now();
      changed = look();
    }
    if (!live_) return;
    live_->hear(feed_, kHearing);
    if (changed || ++turns_ % kTurnsPerShow == 0) live_->show(feed_, store_ ? &*store_ : nullptr);
  }

  ViewAnswer answer(const std::string& path) const {
    return answerAboutKeyframe(path, store_ ? &store_->store() : nullptr, [this](const KeyframeId& id) {
      return store_ ? store_->verdictsOf(id) : live_->verdictsOf(id);
    });
  }

  const ViewFeed& feed() const { return feed_; }

 private:
  Result<bool> openStore(bool with_tiles) {
    Result<StoreScene> store = StoreScene::open(awaited_, with_tiles);
    if (!store) return store.error();
    store_.emplace(std::move(*store));
    awaited_.clear();
    return store_->refresh(feed_);
  }

  // True if the store has changed. While it cannot be read, what was read before is shown; that is told once.
  bool look() {
    const auto read = store_ ? store_->refresh(feed_) : openStore(false);
    if (!read && !store_) return false;  // a core makes it just now
    if (!read && readable_)
      std::fprintf(stderr, "fleet: %s; the page shows what was read before, and it is tried again\n",
                   read.error().text.c_str());
    readable_ = read.operator bool();
    return read && *read;
  }

  ViewFeed feed_;
  std::optional<StoreScene> store_;
  std::string awaited_;  // a store that is not open yet
  std::optional<LiveScene> live_;
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
  bool readable_ = true;
  int turns_ = 0;
};

int run(const ViewOptions& options) {
  if (options.store.empty() && !options.live)
    return failWith({ErrorCode::kWrongUse, "view: name a STORE, or --live, or both"});
  Scenes scenes;
  if (const auto opened = scenes.open(options); !opened) return failWith(opened.error());
  const auto server =
      ViewServer::start(options.server, scenes.feed(), [&](const std::string& path) { return scenes.answer(path); });
  if (!server) return failWith(server.error());
  std::printf("http://%s:%d/\n", options.server.address.c_str(), (*server)->port());
  std::fflush(stdout);

  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  while (g_stop == 0) {
    (*server)->serve(kTurn);
    scenes.follow();
  }
  return 0;
}

}  // namespace

void addViewVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("view", "The map in a web browser: robots, tiles, keyframes and why they matched");
  verb->footer(
      "Prints the address to open and serves until Ctrl-C. A store that a core is writing may be viewed; the page\n"
      "follows it. --live listens to a running core and asks it for tiles; with its STORE too, keyframes have "
      "pictures;\nit may be made later.\n"
      "Nothing is fetched from elsewhere, and pages of other sites are not let in.\n"
      "Example: fleet view run/map.comap --port 8420\n"
      "Example: fleet view --live --site flat");
  auto options = std::make_shared<ViewOptions>();
  verb->add_option("STORE", options->store, "Map store to read");
  verb->add_flag("--live", options->live, "Listen to a running site");
  addObserverOptions(*verb, options->link);
  verb->add_option("--port", options->server.port, "TCP port; 0: any free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  verb->add_option("--address", options->server.address,
                   "IPv4 address to listen on; others than 127.0.0.1 let the network see the map and the pictures")
      ->capture_default_str();
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
