// The server as a browser and as a stranger meet it, over a socket.
#include "fleet_tools/view/view_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "fleet_tools/view/view_assets.h"

namespace comap {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

// A connection that fails instead of waiting for ever.
class Client {
 public:
  explicit Client(int port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    inet_pton(AF_INET, "127.0.0.1", &address.sin_addr);
    const timeval limit{10, 0};
    setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~Client() { close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool connected() const { return connected_; }
  void send(const std::string& text) {
    EXPECT_EQ(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL), ssize_t(text.size()));
  }
  /// What comes until `enough` is in it or the other side closes.
  std::string read(const std::string& enough) {
    while (held_.find(enough) == std::string::npos) {
      char buffer[4096];
      const ssize_t got = recv(socket_, buffer, sizeof buffer, 0);
      if (got <= 0) {
        closed_ = got == 0 || errno == ECONNRESET;
        break;
      }
      held_.append(buffer, static_cast<size_t>(got));
    }
    return held_;
  }
  bool closedByServer() {
    read("\1never\1");
    return closed_;
  }

 private:
  int socket_;
  bool connected_ = false, closed_ = false;
  std::string held_;
};

class Server : public testing::Test {
 protected:
  void SetUp() override {
    feed_.setSection(ViewSection::kSite, R"({"section":"site","title":"here"})");
    ViewServerOptions options;
    options.port = 0;
    options.most_browsers = 2;
    const auto answer = [](const std::string& path) {
      return path == "/keyframe/a/1/2" ? ViewAnswer{200, "application/json", std::string(200000, 'k')}
                                       : ViewAnswer{404, "text/plain", "none"};
    };
    auto server = ViewServer::start(options, feed_, answer);
    ASSERT_TRUE(server) << server.error().text;
    server_ = std::move(*server);
    port_ = server_->port();
    thread_ = std::thread([this] {
      while (!stop_) server_->serve(std::chrono::milliseconds(20));
    });
  }
  void TearDown() override {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  std::string ask(const std::string& path, const std::string& headers, const std::string& method = "GET") {
    Client client(port_);
    EXPECT_TRUE(client.connected());
    client.send(method + " " + path + " HTTP/1.1\r\n" + headers + "Connection: close\r\n\r\n");
    return client.read("\1never\1");
  }
  std::string upgrade(const std::string& origin) const {
    return "GET /feed HTTP/1.1\r\nHost: " + host() + "\r\nOrigin: " + origin +
           "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
           "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: comap-view\r\n\r\n";
  }

  ViewFeed feed_;
  std::unique_ptr<ViewServer> server_;
  int port_ = 0;
  std::thread thread_;
  std::atomic<bool> stop_ = false;
};

TEST_F(Server, GivesThePageAndEachOfItsFiles) {
  const std::string own = "Host: " + host() + "\r\n";
  const std::string page = ask("/", own);
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(page, HasSubstr("default-src 'none'; script-src 'self'"));
  EXPECT_THAT(page, HasSubstr("nosniff"));
  for (const ViewAsset& asset : viewAssets()) {
    const std::string answer = ask(std::string(asset.path), own);
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 200")) << asset.path;
    EXPECT_THAT(answer, HasSubstr("content-type: " + std::string(asset.type) + "\r\n")) << asset.path;
    EXPECT_TRUE(answer.ends_with(asset.content)) << asset.path;
    // What the page loads is here: nothing is fetched from elsewhere. (three.js names its home in remarks.)
    if (asset.path != "/three.min.js" && asset.path != "/icon.svg" && asset.path != "/orbit_controls.js") {
      EXPECT_EQ(asset.content.find("http://"), std::string_view::npos) << asset.path;
      EXPECT_EQ(asset.content.find("https://"), std::string_view::npos) << asset.path;
    }
  }
  EXPECT_TRUE(ask("/keyframe/a/1/2", own).ends_with(std::string(200000, 'k')));
  EXPECT_THAT(ask("/nothing", own), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(ask("/../etc/passwd", own), Not(HasSubstr("root:")));
}

TEST_F(Server, RefusesForeignPagesAndForeignNames) {
  const std::string own = "Host: " + host() + "\r\n";
  EXPECT_THAT(ask("/", own + "Origin: http://" + host() + "\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("/", "Host: localhost:80\r\n"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(ask("/", own + "Origin: http://elsewhere.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(ask("/", own + "Origin: null\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(ask("/", "Host: elsewhere.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(ask("/keyframe/a/1/2", "Host: elsewhere.example\r\n"), StartsWith("HTTP/1.1 403"));
  EXPECT_THAT(ask("/", own + "Content-Length: 0\r\n", "POST"), Not(StartsWith("HTTP/1.1 200")));
}

TEST_F(Server, ABrowserIsFedAndAForeignPageIsNot) {
  Client own(port_), foreign(port_);
  own.send(upgrade("http://" + host()));
  EXPECT_THAT(own.read(R"("title":"here"})"), HasSubstr(R"({"section":"site","title":"here"})"));
  foreign.send(upgrade("http://elsewhere.example"));
  EXPECT_TRUE(foreign.closedByServer());
  EXPECT_THAT(foreign.read("x"), Not(HasSubstr("101")));
}

TEST_F(Server, OnlySoManyBrowsersAtOnceAndOneThatTalksIsCutOff) {
  Client first(port_), second(port_), third(port_);
  for (Client* client : {&first, &second}) {
    client->send(upgrade("http://" + host()));
    EXPECT_THAT(client->read("here"), HasSubstr("101"));
  }
  third.send(upgrade("http://" + host()));
  EXPECT_TRUE(third.closedByServer());
  // A frame that says it is 2^62 bytes long.
  std::string frame("\x82\xff\x40\0\0\0\0\0\0\0abcd", 14);
  first.send(frame + std::string(1000, 'x'));
  EXPECT_TRUE(first.closedByServer());
  Client fourth(port_);
  fourth.send(upgrade("http://" + host()));
  EXPECT_THAT(fourth.read("here"), HasSubstr("101")) << "there is room again";
}

TEST(ViewServer, SaysWhyItCannotListen) {
  ViewFeed feed;
  ViewServerOptions options;
  options.port = 0;
  const auto first = ViewServer::start(options, feed, {});
  ASSERT_TRUE(first) << first.error().text;
  options.port = (*first)->port();
  const auto second = ViewServer::start(options, feed, {});
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kUnreachable);
  EXPECT_THAT(second.error().text, HasSubstr("is the port taken"));
  options.address = "nowhere";
  const auto third = ViewServer::start(options, feed, {});
  ASSERT_FALSE(third);
  EXPECT_EQ(third.error().code, ErrorCode::kWrongUse);
}

}  // namespace
}  // namespace comap
