// Where datagrams go: an IPv4 address and a UDP port, and the socket for them.
#pragma once

#include <chrono>
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

inline constexpr uint16_t kDiscoveryPort = 7399;  ///< below those of DDS

struct Endpoint {
  uint32_t address = 0;  ///< 10.0.0.1 is 0x0a000001
  uint16_t port = 0;
  /// Which of this machine's addresses its datagrams come to, and those to it leave from; 0: any. Who asked one address
  /// takes no answer from another.
  uint32_t own_address = 0;
  auto operator<=>(const Endpoint&) const = default;
};

inline bool isSameHostPort(const Endpoint& a, const Endpoint& b) { return a.address == b.address && a.port == b.port; }

/// "10.0.0.1:7399".
std::string toString(const Endpoint& endpoint);

struct HostPort {
  std::string host;
  uint16_t port = kDiscoveryPort;
};

/// "HOST" or "HOST:PORT"; HOST is an IPv4 address or a name. kWrongUse naming what was found; `what` names the field.
Result<HostPort> parseHostPort(const std::string& text, const std::string& what);

/// The host's IPv4 address, if `text` is one already.
std::optional<uint32_t> parseAddress(const std::string& text);

/// Asks the system's resolver, which may take many seconds; the first IPv4 address.
std::optional<uint32_t> resolve(const std::string& host);

/// A bound UDP socket. Thread rule: one thread, but for wake().
class DatagramSocket {
 public:
  /// Port 0: any. kUnreachable if it is taken or the address is not this machine's.
  static Result<DatagramSocket> bind(const Endpoint& own);
  DatagramSocket(DatagramSocket&& other) noexcept;
  DatagramSocket& operator=(DatagramSocket&&) = delete;
  ~DatagramSocket();

  uint16_t port() const { return port_; }
  /// What the network does not take is lost, as datagrams are.
  void send(const Endpoint& to, std::span<const uint8_t> bytes) const;
  /// The next datagram and its sender; nothing within `timeout`, or if woken. Larger ones than any of ours are cut.
  std::optional<std::vector<uint8_t>> receive(std::chrono::milliseconds timeout, Endpoint& from) const;
  /// Ends a receive() that waits, or the next one. From any thread.
  void wake() const;

 private:
  DatagramSocket(int socket, int waker, uint16_t port) : socket_(socket), waker_(waker), port_(port) {}
  int socket_ = -1, waker_ = -1;
  uint16_t port_ = 0;
};

}  // namespace comap
