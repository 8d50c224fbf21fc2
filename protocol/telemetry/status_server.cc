#include "protocol/telemetry/status_server.h"

#include <civetweb.h>

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

// The library counts its users.
struct StatusLibrary {
  StatusLibrary() { mg_init_library(0); }
  ~StatusLibrary() { mg_exit_library(); }
  StatusLibrary(const StatusLibrary&) = delete;
  StatusLibrary& operator=(const StatusLibrary&) = delete;
};

const char* reasonOf(int status) {
  switch (status) {
    case 200:
      return "OK";
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

}  // namespace

StatusServer::StatusServer() : page_(std::make_unique<Page>()) {}

Result<std::unique_ptr<StatusServer>> StatusServer::start(const std::string& address, int port,
                                                          std::chrono::milliseconds patience) {
  mg_init_library(0);
  std::unique_ptr<StatusServer> server(new StatusServer);
  server->page_->patience = patience;
  const std::string listen = address + ":" + std::to_string(port);
  // Nothing is served from disk; a handful of watchers is all that is expected, and nobody may hold a thread for long.
  const std::array<const char*, 11> options{
      "listening_ports",   listen.c_str(), "num_threads", "8", "request_timeout_ms", "1000", "max_request_size", "8192",
      "enable_keep_alive", "no",           nullptr};
  mg_callbacks callbacks{};
  mg_init_data init{};
  init.callbacks = &callbacks;
  init.user_data = server->page_.get();
  init.configuration_options = const_cast<const char**>(options.data());
  std::array<char, 256> text{};
  mg_error_data error{};
  error.text = text.data();
  error.text_buffer_size = text.size();
  errno = 0;
  mg_context* context = mg_start2(&init, &error);
  if (context == nullptr)
    return Error{ErrorCode::kUnreachable, "status page: cannot listen on " + listen + ": " +
                                              (text[0] != 0 ? std::string(text.data()) : std::strerror(errno)) +
                                              "; is another program there? Choose another status.port"};
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

Result<std::string> askStatus(const std::string& address, int port, const std::string& path) {
  constexpr size_t kMostBytes = 1u << 20;
  // What listens on all interfaces answers on loopback.
  const std::string host = address == "0.0.0.0" ? "127.0.0.1" : address;
  const std::string where = "http://" + host + ":" + std::to_string(port) + path;
  const StatusLibrary library;
  std::array<char, 256> error{};
  mg_connection* connection = mg_download(host.c_str(), port, 0, error.data(), error.size(),
                                          "GET %s HTTP/1.0\r\nHost: %s\r\n\r\n", path.c_str(), host.c_str());
  if (connection == nullptr) return Error{ErrorCode::kUnreachable, where + ": " + error.data()};
  const int status = mg_get_response_info(connection)->status_code;
  std::string body;
  std::array<char, 4096> part;
  for (int n = 0; body.size() < kMostBytes && (n = mg_read(connection, part.data(), part.size())) > 0;)
    body.append(part.data(), static_cast<size_t>(n));
  mg_close_connection(connection);
  while (!body.empty() && body.back() == '\n') body.pop_back();
  if (status != 200) return Error{ErrorCode::kProblem, where + ": " + body};
  return body;
}

}  // namespace comap
