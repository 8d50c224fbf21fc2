#include "fleet_tools/view/view_server.h"

#include <arpa/inet.h>
#include <libwebsockets.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "fleet_tools/view/tile_message.h"
#include "fleet_tools/view/view_assets.h"

namespace comap {
namespace {

static_assert(LWS_PRE <= kMessageHeadroom);

constexpr size_t kChunkBytes = 32768;  // of an HTTP body at once
constexpr size_t kMostAtOnce = 16;     // messages to a browser before others have their turn
constexpr unsigned kMostConnections = 128;

// Everything comes from this server; the page's own style attributes are set by script.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string headerOf(lws* wsi, lws_token_indexes token) {
  const int length = lws_hdr_total_length(wsi, token);
  if (length <= 0) return {};
  std::string text(static_cast<size_t>(length) + 1, '\0');
  const int copied = lws_hdr_copy(wsi, text.data(), static_cast<int>(text.size()), token);
  text.resize(copied > 0 ? static_cast<size_t>(copied) : 0);
  return text;
}

struct Exchange {
  ViewAnswer answer;
  std::string_view body;
  size_t sent = 0;
};

// What libwebsockets keeps for each connection: zeroed memory, so pointers only.
struct Connection {
  Exchange* exchange;
  FeedCursor* cursor;
};

class LwsServer : public ViewServer {
 public:
  LwsServer(const ViewServerOptions& options, const ViewFeed& feed, Answer answer)
      : options_(options), feed_(feed), answer_(std::move(answer)) {
    protocols_[0] = {"http", onHttp, sizeof(Connection), 0, 0, this, 0};
    // The smallest buffer: browsers send nothing but control frames.
    protocols_[1] = {"comap-view", onSocket, sizeof(Connection), 128, 0, this, 0};
  }
  ~LwsServer() override {
    if (context_ != nullptr) lws_context_destroy(context_);
  }

  // The library serves on without a word where it cannot listen.
  Result<void> isOwn(const in_addr& address) const {
    const int tried = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr = address;
    const bool bound = tried >= 0 && bind(tried, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
    const int why = errno;
    if (tried >= 0) close(tried);
    if (bound) return {};
    return Error{ErrorCode::kUnreachable, "--address " + options_.address +
                                              ": cannot listen there: " + std::generic_category().message(why) +
                                              "; expected an address of this machine"};
  }

  Result<void> open() {
    in_addr parsed{};
    if (inet_pton(AF_INET, options_.address.c_str(), &parsed) != 1)
      return Error{ErrorCode::kWrongUse, "--address is '" + options_.address + "', expected an IPv4 address"};
    if (auto own = isOwn(parsed); !own) return own;
    lws_set_log_level(0, nullptr);
    lws_context_creation_info info{};
    info.port = options_.port;
    info.iface = options_.address.c_str();
    info.protocols = protocols_.data();
    info.gid = static_cast<gid_t>(-1);
    info.uid = static_cast<uid_t>(-1);
    info.fd_limit_per_thread = kMostConnections;
    info.user = this;
    info.timeout_secs = 10;
    info.keepalive_timeout = 20;
    info.options = LWS_SERVER_OPTION_DISABLE_IPV6 | LWS_SERVER_OPTION_EXPLICIT_VHOSTS;
    context_ = lws_create_context(&info);
    if (context_ == nullptr) return Error{ErrorCode::kUnreachable, "the web server cannot be set up"};
    vhost_ = lws_create_vhost(context_, &info);
    if (vhost_ == nullptr || port() <= 0)
      return Error{ErrorCode::kUnreachable, options_.address + ":" + std::to_string(options_.port) +
                                                ": cannot listen there; is the port taken? --port names another"};
    return {};
  }

  int port() const override { return lws_get_vhost_listen_port(vhost_); }

  void serve(std::chrono::milliseconds period) override {
    lws_callback_on_writable_all_protocol(context_, &protocols_[1]);
    Pause pause;
    pause.context = context_;
    lws_sul_schedule(context_, 0, &pause.timer, onPauseOver,
                     std::chrono::duration_cast<std::chrono::microseconds>(period).count());
    while (!pause.over)
      if (lws_service(context_, 0) < 0) break;
    lws_sul_schedule(context_, 0, &pause.timer, nullptr, LWS_SET_TIMER_USEC_CANCEL);
  }

 private:
  struct Pause {
    lws_sorted_usec_list_t timer{};  // first, as that is what the callback gets
    lws_context* context = nullptr;
    bool over = false;
  };
  static void onPauseOver(lws_sorted_usec_list_t* timer) {
    auto* pause = reinterpret_cast<Pause*>(timer);
    pause->over = true;
    lws_cancel_service(pause->context);  // timers are looked at before the wait for sockets, which has no other end
  }

  static LwsServer& serverOf(lws* wsi) { return *static_cast<LwsServer*>(lws_get_protocol(wsi)->user); }

  static int onHttp(lws* wsi, lws_callback_reasons reason, void* user, void* in, size_t length) {
    auto* connection = static_cast<Connection*>(user);
    switch (reason) {
      case LWS_CALLBACK_HTTP:
        return serverOf(wsi).begin(wsi, *connection, {static_cast<const char*>(in), length});
      case LWS_CALLBACK_HTTP_WRITEABLE:
        return connection->exchange == nullptr ? 0 : serverOf(wsi).proceed(wsi, *connection);
      case LWS_CALLBACK_CLOSED_HTTP:
      case LWS_CALLBACK_HTTP_DROP_PROTOCOL:
        if (connection != nullptr) forget(*connection);
        return 0;
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:  // a WebSocket that names no protocol
      case LWS_CALLBACK_HTTP_BODY:
      case LWS_CALLBACK_HTTP_BODY_COMPLETION:
        return -1;
      default:
        return lws_callback_http_dummy(wsi, reason, user, in, length);
    }
  }

  static int onSocket(lws* wsi, lws_callback_reasons reason, void* user, void*, size_t) {
    auto* connection = static_cast<Connection*>(user);
    LwsServer* server = nullptr;
    if (wsi != nullptr && lws_get_protocol(wsi) != nullptr) server = &serverOf(wsi);
    switch (reason) {
      case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION: {
        const std::string host = headerOf(wsi, WSI_TOKEN_HOST), origin = headerOf(wsi, WSI_TOKEN_ORIGIN);
        const bool room = server->browsers_ < static_cast<size_t>(server->options_.most_browsers);
        return room && isOwnHost(host) && isOwnOrigin(origin, host) ? 0 : -1;
      }
      case LWS_CALLBACK_ESTABLISHED:
        connection->cursor = new FeedCursor;
        ++server->browsers_;
        lws_callback_on_writable(wsi);
        return 0;
      case LWS_CALLBACK_SERVER_WRITEABLE:
        return server->push(wsi, *connection);
      case LWS_CALLBACK_RECEIVE:
        return -1;
      case LWS_CALLBACK_CLOSED:
        if (connection->cursor != nullptr) --server->browsers_;
        forget(*connection);
        return 0;
      default:
        return 0;
    }
  }

  static void forget(Connection& connection) {
    delete connection.exchange;
    delete connection.cursor;
    connection.exchange = nullptr;
    connection.cursor = nullptr;
  }

  int push(lws* wsi, Connection& connection) {
    for (size_t i = 0; i < kMostAtOnce; ++i) {
      const FeedMessage message = feed_.next(*connection.cursor);
      if (!message.bytes) return 0;
      const size_t size = message.bytes->size() - kMessageHeadroom;
      if (lws_write(wsi, message.bytes->data() + kMessageHeadroom, size,
                    message.binary ? LWS_WRITE_BINARY : LWS_WRITE_TEXT) < static_cast<int>(size))
        return -1;
      if (lws_send_pipe_choked(wsi) != 0) break;
    }
    lws_callback_on_writable(wsi);
    return 0;
  }

  ViewAnswer answerTo(lws* wsi, const std::string& path, std::string_view& fixed) const {
    const std::string host = headerOf(wsi, WSI_TOKEN_HOST), origin = headerOf(wsi, WSI_TOKEN_ORIGIN);
    if (!isOwnHost(host) || !isOwnOrigin(origin, host)) return {403, "text/plain", "not for other sites\n"};
    if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) <= 0) return {405, "text/plain", "only GET\n"};
    for (const ViewAsset& asset : viewAssets()) {
      if (asset.path != path && !(path == "/" && asset.path == "/index.html")) continue;
      fixed = asset.content;
      return {200, std::string(asset.type), {}};
    }
    if (path.starts_with("/keyframe/") || path.starts_with("/picture/")) return answer_(path);
    return {404, "text/plain", "no such page\n"};
  }

  int begin(lws* wsi, Connection& connection, const std::string& path) {
    forget(connection);
    connection.exchange = new Exchange;
    Exchange& exchange = *connection.exchange;
    exchange.answer = answerTo(wsi, path, exchange.body);
    if (exchange.body.empty()) exchange.body = exchange.answer.body;

    std::array<uint8_t, LWS_PRE + 2048> buffer{};
    uint8_t *at = buffer.data() + LWS_PRE, *const start = at, *const end = buffer.data() + buffer.size() - 1;
    const auto add = [&](const char* name, const char* value) {
      return lws_add_http_header_by_name(wsi, reinterpret_cast<const uint8_t*>(name),
                                         reinterpret_cast<const uint8_t*>(value), static_cast<int>(std::strlen(value)),
                                         &at, end) != 0;
    };
    if (lws_add_http_common_headers(wsi, static_cast<unsigned>(exchange.answer.status), exchange.answer.type.c_str(),
                                    exchange.body.size(), &at, end) != 0 ||
        add("content-security-policy:", kPolicy) || add("x-content-type-options:", "nosniff") ||
        add("cross-origin-resource-policy:", "same-origin") || add("referrer-policy:", "no-referrer") ||
        add("cache-control:", "no-cache") || lws_finalize_write_http_header(wsi, start, &at, end) != 0)
      return 1;
    lws_callback_on_writable(wsi);
    return 0;
  }

  int proceed(lws* wsi, Connection& connection) {
    Exchange& exchange = *connection.exchange;
    std::array<uint8_t, LWS_PRE + kChunkBytes> buffer;
    const size_t size = std::min(kChunkBytes, exchange.body.size() - exchange.sent);
    std::copy_n(exchange.body.data() + exchange.sent, size, buffer.data() + LWS_PRE);
    const bool last = exchange.sent + size == exchange.body.size();
    if (lws_write(wsi, buffer.data() + LWS_PRE, size, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
        static_cast<int>(size))
      return -1;
    exchange.sent += size;
    if (!last) {
      lws_callback_on_writable(wsi);
      return 0;
    }
    forget(connection);
    return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
  }

  const ViewServerOptions options_;
  const ViewFeed& feed_;
  const Answer answer_;
  std::array<lws_protocols, 3> protocols_{};
  lws_context* context_ = nullptr;
  lws_vhost* vhost_ = nullptr;
  size_t browsers_ = 0;
};

std::string withoutPort(const std::string& host) {
  const size_t colon = host.rfind(':');
  if (colon == std::string::npos || host.find(']', colon) != std::string::npos) return host;
  const bool digits = std::all_of(host.begin() + static_cast<ptrdiff_t>(colon) + 1, host.end(),
                                  [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; });
  return digits ? host.substr(0, colon) : host;
}

}  // namespace

bool isOwnHost(const std::string& host) {
  const std::string name = withoutPort(host);
  in_addr parsed{};
  return name == "localhost" || inet_pton(AF_INET, name.c_str(), &parsed) == 1;
}

bool isOwnOrigin(const std::string& origin, const std::string& host) {
  return origin.empty() || origin == "http://" + host;
}

Result<std::unique_ptr<ViewServer>> ViewServer::start(const ViewServerOptions& options, const ViewFeed& feed,
                                                      Answer answer) {
  auto server = std::make_unique<LwsServer>(options, feed, std::move(answer));
  if (auto opened = server->open(); !opened) return opened.error();
  return std::unique_ptr<ViewServer>(std::move(server));
}

}  // namespace comap
