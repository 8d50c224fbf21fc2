// HTTP and WebSocket for browsers on 127.0.0.1 or a chosen address: the page, the feed, answers about keyframes.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "fleet_tools/view/view_feed.h"
#include "protocol/types/result.h"

namespace comap {

struct ViewServerOptions {
  std::string address = "127.0.0.1";  ///< IPv4 to listen on
  int port = 8420;                    ///< 0: any free one
  int most_browsers = 16;             ///< WebSockets at once
};

/// What a request for a path is answered with.
struct ViewAnswer {
  int status = 200;
  std::string type = "text/plain; charset=utf-8";
  std::string body;
};

/// Pages of other sites are refused: by Origin, which must be the address asked for, and by Host, which must be an
/// address or localhost, so that no foreign name can be bent to this server. Only GET; requests carry no bodies;
/// browsers have nothing to say over the WebSocket and are cut off if they do. To each browser one message is under
/// way, the rest is its FeedCursor.
/// Thread rule: one thread.
class ViewServer {
 public:
  /// Answers paths below "/keyframe/" and "/picture/".
  using Answer = std::function<ViewAnswer(const std::string& path)>;

  /// kUnreachable if the port is taken, kWrongUse if the address is none. `feed` must outlive the server.
  static Result<std::unique_ptr<ViewServer>> start(const ViewServerOptions& options, const ViewFeed& feed,
                                                   Answer answer);
  virtual ~ViewServer() = default;

  virtual int port() const = 0;
  /// Serves for about `period`, then returns. Call it again and again.
  virtual void serve(std::chrono::milliseconds period) = 0;
};

/// Whether a Host header names this server by an address, or as localhost, and not by some name of the outer world.
bool isOwnHost(const std::string& host);
/// Whether a page of this Origin may talk to a server asked for as `host`; an empty one is no browser's.
bool isOwnOrigin(const std::string& origin, const std::string& host);

}  // namespace comap
