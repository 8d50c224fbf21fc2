#include <signal.h>

#include <cstdio>
#include <memory>
#include <optional>

#include "fleet_tools/fail.h"
#include "fleet_tools/verb.h"
#include "fleet_tools/view/keyframe_answers.h"
#include "fleet_tools/view/store_scene.h"
#include "fleet_tools/view/view_server.h"

namespace comap {
namespace {

constexpr std::chrono::milliseconds kTurn(100);
constexpr std::chrono::seconds kStoreLook(2);

volatile sig_atomic_t g_stop = 0;

struct ViewOptions {
  std::string store;
  ViewServerOptions server;
};

int run(const ViewOptions& options) {
  ViewFeed feed;
  Result<StoreScene> store = StoreScene::open(options.store, true);
  if (!store) return failWith(store.error());
  if (const auto read = store->refresh(feed); !read) return failWith(read.error());
  const auto answer = [&](const std::string& path) {
    return answerAboutKeyframe(path, &store->store(), [&](const KeyframeId& id) { return store->verdictsOf(id); });
  };
  const auto server = ViewServer::start(options.server, feed, answer);
  if (!server) return failWith(server.error());
  std::printf("http://%s:%d/\n", options.server.address.c_str(), (*server)->port());
  std::fflush(stdout);

  struct sigaction action {};
  action.sa_handler = [](int) { g_stop = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  auto looked = std::chrono::steady_clock::now();
  while (g_stop == 0) {
    (*server)->serve(kTurn);
    if (std::chrono::steady_clock::now() - looked < kStoreLook) continue;
    looked = std::chrono::steady_clock::now();
    if (const auto read = store->refresh(feed); !read) return failWith(read.error());
  }
  return 0;
}

}  // namespace

void addViewVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("view", "The map in a web browser: robots, tiles, keyframes and why they matched");
  verb->footer(
      "Prints the address to open and serves until Ctrl-C. A store that a core is writing may be viewed; the page\n"
      "follows it. Nothing is fetched from elsewhere, and pages of other sites are not let in.\n"
      "Example: fleet view run/map.comap --port 8420");
  auto options = std::make_shared<ViewOptions>();
  verb->add_option("STORE", options->store, "Map store to read")->required();
  verb->add_option("--port", options->server.port, "TCP port; 0: any free one")->check(CLI::Range(0, 65535));
  verb->add_option("--address", options->server.address,
                   "IPv4 address to listen on; others than 127.0.0.1 let the network see the map and the pictures");
  verb->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace comap
