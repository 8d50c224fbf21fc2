#include "protocol/telemetry/status_server.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <thread>
#include <vector>

#include "protocol/telemetry/ask_status.h"
#include "tests/protocol/telemetry/http_get.h"

namespace comap {
namespace {

using std::chrono::milliseconds;

std::unique_ptr<StatusServer> serve(milliseconds patience = StatusServer::kPatience) {
  auto server = StatusServer::start("127.0.0.1", 0, patience);
  EXPECT_TRUE(server) << server.error().text;
  return server ? std::move(*server) : nullptr;
}

TEST(StatusServer, BeforeTheFirstReportItIsHealthyAndNotReady) {
  const auto server = serve(milliseconds(1));
  std::this_thread::sleep_for(milliseconds(20));
  EXPECT_EQ(httpGet(server->port(), "/healthz").status, 200);
  const HttpAnswer ready = httpGet(server->port(), "/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_EQ(nlohmann::json::parse(ready.body), (nlohmann::json{{"ready", false}, {"state", "starting"}}));
}

TEST(StatusServer, TellsWhatWasPublishedLast) {
  const auto server = serve();
  server->publish("old 1\n", {false, "warming up"});
  EXPECT_EQ(httpGet(server->port(), "/readyz").status, 503);
  server->publish("comap_maps 2\n", {true, "2 robots"});
  const HttpAnswer metrics = httpGet(server->port(), "/metrics");
  EXPECT_EQ(metrics.status, 200);
  EXPECT_EQ(metrics.body, "comap_maps 2\n");
  EXPECT_NE(metrics.head.find("text/plain; version=0.0.4"), std::string::npos) << metrics.head;
  const HttpAnswer ready = httpGet(server->port(), "/readyz");
  EXPECT_EQ(ready.status, 200);
  EXPECT_EQ(nlohmann::json::parse(ready.body), (nlohmann::json{{"ready", true}, {"state", "2 robots"}}));
}

TEST(StatusServer, WhoSaysNothingForLongIsStuck) {
  const auto server = serve(milliseconds(50));
  server->publish("", {true, "at work"});
  std::this_thread::sleep_for(milliseconds(120));
  EXPECT_EQ(httpGet(server->port(), "/healthz").status, 503);
  EXPECT_EQ(httpGet(server->port(), "/readyz").status, 503);
  server->publish("", {true, "at work"});
  EXPECT_EQ(httpGet(server->port(), "/healthz").status, 200);
}

TEST(StatusServer, NothingElseIsServed) {
  const auto server = serve();
  server->publish("x 1\n", {true, ""});
  for (const char* path : {"/", "/metrics/..", "/../../etc/passwd", "/etc/passwd", "/metricsx"})
    EXPECT_EQ(httpGet(server->port(), path).status, 404) << path;
  EXPECT_EQ(httpSend(server->port(), "POST /metrics HTTP/1.1\r\nHost: x\r\nContent-Length: 0\r\n\r\n").status, 405);
  EXPECT_EQ(httpSend(server->port(), "HEAD /metrics HTTP/1.1\r\nHost: x\r\n\r\n").body, "");
}

TEST(StatusServer, DamagedRequestsDoNotEndIt) {
  const auto server = serve();
  server->publish("x 1\n", {true, ""});
  httpSend(server->port(), "\r\n\r\n");
  httpSend(server->port(), std::string(100000, 'A') + "\r\n\r\n");
  httpSend(server->port(), std::string("GET /metrics\0 HTTP/9.9\r\n\r\n", 26));
  EXPECT_EQ(httpGet(server->port(), "/metrics").status, 200);
}

TEST(StatusServer, RefusesWebSocketsAndGoesOn) {
  const auto server = serve();
  server->publish("", {true, "at work"});
  for (const char* path : {"/ws", "/metrics", "/x"}) {
    const std::string request = std::string("GET ") + path +
                                " HTTP/1.1\r\nHost: x\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
                                "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    EXPECT_EQ(httpSend(server->port(), request).status, 400) << path;
  }
  EXPECT_EQ(httpGet(server->port(), "/healthz").status, 200);
}

TEST(StatusServer, ManyReadersAtOnceWhileReportsCome) {
  const auto server = serve();
  server->publish("x 0\n", {true, ""});
  std::vector<std::thread> readers;
  std::vector<int> good(8);
  for (int& count : good)
    readers.emplace_back([&] {
      for (int i = 0; i < 20; ++i) count += httpGet(server->port(), "/metrics").body.starts_with("x ");
    });
  for (int i = 0; i < 1000; ++i) server->publish("x " + std::to_string(i) + "\n", {true, ""});
  for (std::thread& reader : readers) reader.join();
  for (const int count : good) EXPECT_EQ(count, 20);
}

// Connections that are opened and never ask anything, more than there are threads for.
TEST(StatusServer, SlowConnectionsDoNotKeepOthersOut) {
  const auto server = serve();
  server->publish("", {true, "at work"});
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<uint16_t>(server->port()));
  std::vector<int> slow;
  for (int i = 0; i < 230; ++i) {
    slow.push_back(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
    (void)connect(slow.back(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
  }
  std::this_thread::sleep_for(milliseconds(50));
  for (const int fd : slow) (void)send(fd, "GET /met", 8, MSG_NOSIGNAL);
  const auto health = askStatus("127.0.0.1", server->port(), "/healthz", milliseconds(15000));
  EXPECT_TRUE(health) << health.error().text;
  for (const int fd : slow) close(fd);
}

TEST(StatusServer, AProgramCanBeAskedByAnother) {
  const auto server = serve();
  server->publish("x 1\n", {false, "warming up"});
  const auto health = askStatus("127.0.0.1", server->port(), "/healthz");
  ASSERT_TRUE(health) << health.error().text;
  EXPECT_EQ(nlohmann::json::parse(*health).at("healthy"), true);
  const auto ready = askStatus("0.0.0.0", server->port(), "/readyz");
  ASSERT_FALSE(ready);
  EXPECT_EQ(ready.error().code, ErrorCode::kProblem);
  EXPECT_NE(ready.error().text.find("warming up"), std::string::npos) << ready.error().text;
  const auto nobody = askStatus("127.0.0.1", 1, "/healthz");
  ASSERT_FALSE(nobody);
  EXPECT_EQ(nobody.error().code, ErrorCode::kUnreachable);
}

TEST(StatusServer, APortInUseIsSaid) {
  const auto first = serve();
  const auto second = StatusServer::start("127.0.0.1", first->port());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(second.error().text.find(std::to_string(first->port())), std::string::npos) << second.error().text;
  EXPECT_NE(second.error().text.find("another program"), std::string::npos) << second.error().text;
}

TEST(StatusServer, AnAddressThatIsNotHereIsSaid) {
  const auto elsewhere = StatusServer::start("203.0.113.7", 0), unknown = StatusServer::start("no address", 0);
  ASSERT_FALSE(elsewhere);
  EXPECT_NE(elsewhere.error().text.find("'203.0.113.7' is not an address of this machine"), std::string::npos)
      << elsewhere.error().text;
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().text.find("'no address' is neither an address nor a name"), std::string::npos)
      << unknown.error().text;
}

// It takes the connection, as the kernel does for a program that is stopped, and says nothing.
TEST(StatusServer, WhoAsksAProgramThatHangsIsToldSoon) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(fd, 1), 0);
  ASSERT_EQ(getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  const auto answer = askStatus("127.0.0.1", ntohs(address.sin_port), "/healthz", milliseconds(100));
  close(fd);
  ASSERT_FALSE(answer);
  EXPECT_EQ(answer.error().code, ErrorCode::kUnreachable);
  EXPECT_NE(answer.error().text.find("has not answered it in 100 ms"), std::string::npos) << answer.error().text;
}

}  // namespace
}  // namespace comap
