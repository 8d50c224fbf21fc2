#include "protocol/telemetry/ask_status.h"

#include <civetweb.h>

#include <array>
#include <memory>

namespace comap {
namespace {

// The library counts its users.
struct StatusLibrary {
  StatusLibrary() { mg_init_library(0); }
  ~StatusLibrary() { mg_exit_library(); }
  StatusLibrary(const StatusLibrary&) = delete;
  StatusLibrary& operator=(const StatusLibrary&) = delete;
};

struct Close {
  void operator()(mg_connection* connection) const { mg_close_connection(connection); }
};

}  // namespace

Result<std::string> askStatus(const std::string& address, int port, const std::string& path,
                              std::chrono::milliseconds patience) {
  using Clock = std::chrono::steady_clock;
  constexpr size_t kMostBytes = 1u << 20;
  // What listens on all interfaces answers on loopback.
  const std::string host = address == "0.0.0.0" ? "127.0.0.1" : address;
  const std::string where = "http://" + host + ":" + std::to_string(port) + path;
  const StatusLibrary library;
  std::array<char, 256> error{};
  const std::unique_ptr<mg_connection, Close> connection(
      mg_connect_client(host.c_str(), port, 0, error.data(), error.size()));
  if (!connection) return Error{ErrorCode::kUnreachable, where + ": " + error.data()};
  mg_printf(connection.get(), "GET %s HTTP/1.0\r\nHost: %s\r\n\r\n", path.c_str(), host.c_str());
  const auto asked = Clock::now();
  if (mg_get_response(connection.get(), error.data(), error.size(), static_cast<int>(patience.count())) < 0) {
    if (Clock::now() - asked < patience) return Error{ErrorCode::kUnreachable, where + ": " + error.data()};
    return Error{ErrorCode::kUnreachable, where + ": takes the question and has not answered it in " +
                                              std::to_string(patience.count()) +
                                              " ms: the program there hangs, or is stopped"};
  }
  const int status = mg_get_response_info(connection.get())->status_code;
  std::string body;
  std::array<char, 4096> part;
  for (int n = 0; body.size() < kMostBytes && (n = mg_read(connection.get(), part.data(), part.size())) > 0;)
    body.append(part.data(), static_cast<size_t>(n));
  while (!body.empty() && body.back() == '\n') body.pop_back();
  if (status != 200) return Error{ErrorCode::kProblem, where + ": " + body};
  return body;
}

}  // namespace comap
