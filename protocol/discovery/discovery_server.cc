#include "protocol/discovery/discovery_server.h"

#include <array>
#include <atomic>
#include <random>

#include "protocol/discovery/introductions.h"

namespace comap {
namespace {

std::array<uint8_t, 32> newSecret() {
  std::array<uint8_t, 32> secret{};
  std::random_device random;  // the kernel's
  for (uint8_t& byte : secret) byte = static_cast<uint8_t>(random());
  return secret;
}

}  // namespace

struct DiscoveryServer::Shared {
  Shared(DatagramSocket own_socket, std::function<void(const std::string&)> tell)
      : socket(std::move(own_socket)), introductions(newSecret(), std::move(tell)) {}

  void serve() {
    constexpr std::chrono::milliseconds kWait(1000);
    while (!stop) {
      Endpoint from;
      const auto datagram = socket.receive(kWait, from);
      if (!datagram) continue;
      for (const auto& [to, bytes] : introductions.take(from, *datagram, Introductions::Clock::now()))
        socket.send(to, bytes);
    }
  }

  DatagramSocket socket;
  Introductions introductions;
  std::atomic<bool> stop = false;
};

Result<std::unique_ptr<DiscoveryServer>> DiscoveryServer::start(const Endpoint& own,
                                                                std::function<void(const std::string&)> tell) {
  auto socket = DatagramSocket::bind(own);
  if (!socket) return Error{socket.error().code, "discovery server: " + socket.error().text};
  return std::unique_ptr<DiscoveryServer>(
      new DiscoveryServer(std::make_unique<Shared>(std::move(*socket), std::move(tell))));
}

DiscoveryServer::DiscoveryServer(std::unique_ptr<Shared> shared)
    : shared_(std::move(shared)), thread_([state = shared_.get()] { state->serve(); }) {}

DiscoveryServer::~DiscoveryServer() {
  shared_->stop = true;
  shared_->socket.wake();
  thread_.join();
}

uint16_t DiscoveryServer::port() const { return shared_->socket.port(); }

}  // namespace comap
