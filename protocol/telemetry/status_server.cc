#include "protocol/telemetry/status_server.h"

#include <civetweb.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;

constexpr char kMetricsType[] = "text/plain; version=0.0.4; charset=utf-8";
constexpr char kJsonType[] = "application/json";

struct Answer {
  int status = 200;
  std::string type, body;
};

std::string jsonBody(const char* key, bool value, const std::string& state) {
  return nlohmann::json{{key, value}, {"state", state}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
}

}  // namespace

struct StatusServer::Page {
  std::mutex mutex;
  std::string metrics;
  Readiness readiness{false, "starting"};
  std::optional<Clock::time_point> published;
  std::chrono::milliseconds patience{};

  Answer answer(const std::string& path) {
    const std::scoped_lock lock(mutex);
    if (path == "/metrics") return {200, kMetricsType, metrics};
    const bool stuck = published && Clock::now() - *published > patience;
    const std::string silent = "has done nothing for over " + std::to_string(patience.count() / 1000) + " s";
    if (path == "/healthz")
      return {stuck ? 503 : 200, kJsonType, jsonBody("healthy", !stuck, stuck ? silent : readiness.state)};
    const bool ready = readiness.ready && !stuck;
    if (path == "/readyz")
      return {ready ? 200 : 503, kJsonType, jsonBody("ready", ready, stuck ? silent : readiness.state)};
    return {404, "text/plain", "there is /metrics, /healthz and /readyz\n"};
  }
};

namespace {

const char* reasonOf(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 400:
      return "Bad Request";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    default:
      return "Service Unavailable";
  }
}

void send(mg_connection* connection, const Answer& answer, bool with_body) {
  mg_printf(connection,
            "HTTP/1.1 %d %s\r\nContent-Type: %s\r\nContent-Length: %zu\r\nCache-Control: no-store\r\nConnection: "
            "close\r\n\r\n",
            answer.status, reasonOf(answer.status), answer.type.c_str(), answer.body.size());
  if (with_body) mg_write(connection, answer.body.data(), answer.body.size());
}

// Why nobody can listen there. The HTTP library does not tell apart what is not an address and what is taken.
std::string whyNot(const std::string& address, int port) {
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  const std::string host =
      address.starts_with('[') && address.ends_with(']') ? address.substr(1, address.size() - 2) : address;
  if (const int code = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found); code != 0)
    return "status.address '" + address + "' is neither an address nor a name that this machine can resolve (" +
           gai_strerror(code) + ")";
  const int fd = socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
  const int on = 1;  // as the library does
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const bool free = bind(fd, found->ai_addr, found->ai_addrlen) == 0 && listen(fd, 1) == 0;
  const int code = free ? 0 : errno;
  freeaddrinfo(found);
  close(fd);
  switch (code) {
    case EADDRNOTAVAIL:
      return "status.address '" + address + "' is not an address of this machine";
    case EADDRINUSE:
      return "another program listens on this port; choose another status.port";
    case EACCES:
      return "ports below 1024 need rights that this program has not; choose another status.port";
    default:
      return code == 0 ? std::string() : std::strerror(code);
  }
}

}  // namespace

StatusServer::StatusServer() : page_(std::make_unique<Page>()) {}

Result<std::unique_ptr<StatusServer>> StatusServer::start(const std::string& address, int port,
                                                          std::chrono::milliseconds patience) {
  mg_init_library(0);
  std::unique_ptr<StatusServer> server(new StatusServer);
  server->page_->patience = patience;
  const std::string listen = address + ":" + std::to_string(port);
  // Nothing is served from disk; a handful of watchers is all that is expected. Who connects and says nothing holds a
  // thread for half a second, and there are many: a few hundred such are over in seconds, and none is turned away.
  const std::array<const char*, 15> options{"listening_ports",
                                            listen.c_str(),
                                            "num_threads",
                                            "64",
                                            "request_timeout_ms",
                                            "500",
                                            "max_request_size",
                                            "8192",
                                            "connection_queue",
                                            "256",
                                            "listen_backlog",
                                            "1024",
                                            "enable_keep_alive",
                                            "no",
                                            nullptr};
  mg_callbacks callbacks{};
  // Upgrades to web sockets are refused here: the library's own refusal can end the program.
  callbacks.begin_request = [](mg_connection* connection) {
    if (mg_get_header(connection, "Upgrade") == nullptr) return 0;
    send(connection, {400, "text/plain", "only plain HTTP\n"}, true);
    return 400;
  };
  mg_init_data init{};
  init.callbacks = &callbacks;
  init.user_data = server->page_.get();
  init.configuration_options = const_cast<const char**>(options.data());
  std::array<char, 256> text{};
  mg_error_data error{};
  error.text = text.data();
  error.text_buffer_size = text.size();
  mg_context* context = mg_start2(&init, &error);
  if (context == nullptr) {
    const std::string why = whyNot(address, port);
    return Error{ErrorCode::kUnreachable,
                 "status page: cannot listen on " + listen + ": " + (why.empty() ? text.data() : why)};
  }
  server->context_ = context;
  mg_server_port ports{};
  if (mg_get_server_ports(context, 1, &ports) == 1) server->port_ = ports.port;
  mg_set_request_handler(
      context, "/",
      [](mg_connection* connection, void* page) {
        const mg_request_info* request = mg_get_request_info(connection);
        const std::string method = request->request_method;
        if (method != "GET" && method != "HEAD") {
          send(connection, {405, "text/plain", "only GET\n"}, true);
          return 405;
        }
        const Answer answer = static_cast<Page*>(page)->answer(request->local_uri);
        send(connection, answer, method == "GET");
        return answer.status;
      },
      server->page_.get());
  return server;
}

StatusServer::~StatusServer() {
  if (context_ != nullptr) mg_stop(static_cast<mg_context*>(context_));
  mg_exit_library();
}

void StatusServer::publish(std::string metrics, Readiness readiness) {
  const std::scoped_lock lock(page_->mutex);
  page_->metrics = std::move(metrics);
  page_->readiness = std::move(readiness);
  page_->published = Clock::now();
}

}  // namespace comap
