#include "protocol/discovery/endpoint.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

namespace comap {
namespace {

constexpr size_t kMostDatagramBytes = 2048;

sockaddr_in socketAddress(const Endpoint& endpoint) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(endpoint.address);
  address.sin_port = htons(endpoint.port);
  return address;
}

Endpoint endpointOf(const sockaddr_in& address) { return {ntohl(address.sin_addr.s_addr), ntohs(address.sin_port), 0}; }

}  // namespace

std::string toString(const Endpoint& endpoint) {
  const in_addr address{htonl(endpoint.address)};
  std::array<char, INET_ADDRSTRLEN> text{};
  inet_ntop(AF_INET, &address, text.data(), text.size());
  return std::string(text.data()) + ":" + std::to_string(endpoint.port);
}

std::optional<uint32_t> parseAddress(const std::string& text) {
  in_addr address{};
  if (inet_pton(AF_INET, text.c_str(), &address) != 1) return std::nullopt;
  return ntohl(address.s_addr);
}

Result<HostPort> parseHostPort(const std::string& text, const std::string& what) {
  const Error error{ErrorCode::kWrongUse, what + " '" + text.substr(0, 64) +
                                              "' is no HOST or HOST:PORT (an IPv4 address or a name, and 1 to 65535)"};
  HostPort parsed;
  const size_t colon = text.find(':');
  parsed.host = text.substr(0, colon);
  const bool plain = std::all_of(parsed.host.begin(), parsed.host.end(), [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '-' ||
           c == '_';
  });
  if (parsed.host.empty() || parsed.host.size() > 253 || !plain) return error;
  // A host of digits and dots alone is an address or a slip of the hand, never a name.
  if (parsed.host.find_first_not_of("0123456789.") == std::string::npos && !parseAddress(parsed.host)) return error;
  if (colon == std::string::npos) return parsed;
  const std::string digits = text.substr(colon + 1);
  const auto [end, problem] = std::from_chars(digits.data(), digits.data() + digits.size(), parsed.port);
  if (problem != std::errc() || end != digits.data() + digits.size() || parsed.port == 0) return error;
  return parsed;
}

std::optional<uint32_t> resolve(const std::string& host) {
  if (const auto address = parseAddress(host)) return address;
  addrinfo wanted{};
  wanted.ai_family = AF_INET;
  wanted.ai_socktype = SOCK_DGRAM;
  addrinfo* found = nullptr;
  if (getaddrinfo(host.c_str(), nullptr, &wanted, &found) != 0 || found == nullptr) return std::nullopt;
  sockaddr_in first{};
  std::memcpy(&first, found->ai_addr, std::min<size_t>(sizeof first, found->ai_addrlen));
  freeaddrinfo(found);
  return endpointOf(first).address;
}

Result<DatagramSocket> DatagramSocket::bind(const Endpoint& own) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int waker = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  sockaddr_in address = socketAddress(own);
  socklen_t size = sizeof address;
  const int on = 1;
  if (socket < 0 || waker < 0 || setsockopt(socket, IPPROTO_IP, IP_PKTINFO, &on, sizeof on) != 0 ||
      ::bind(socket, reinterpret_cast<sockaddr*>(&address), size) != 0 ||
      getsockname(socket, reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    const Error error{ErrorCode::kUnreachable,
                      "UDP " + toString(own) + " cannot be listened on: " + std::strerror(errno)};
    if (socket >= 0) close(socket);
    if (waker >= 0) close(waker);
    return error;
  }
  return DatagramSocket(socket, waker, ntohs(address.sin_port));
}

DatagramSocket::DatagramSocket(DatagramSocket&& other) noexcept
    : socket_(std::exchange(other.socket_, -1)), waker_(std::exchange(other.waker_, -1)), port_(other.port_) {}

DatagramSocket::~DatagramSocket() {
  if (socket_ >= 0) close(socket_);
  if (waker_ >= 0) close(waker_);
}

void DatagramSocket::send(const Endpoint& to, std::span<const uint8_t> bytes) const {
  sockaddr_in address = socketAddress(to);
  iovec part{const_cast<uint8_t*>(bytes.data()), bytes.size()};
  alignas(cmsghdr) std::array<uint8_t, CMSG_SPACE(sizeof(in_pktinfo))> control{};
  msghdr message{};
  message.msg_name = &address;
  message.msg_namelen = sizeof address;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  if (to.own_address != 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = IPPROTO_IP;
    header->cmsg_type = IP_PKTINFO;
    header->cmsg_len = CMSG_LEN(sizeof(in_pktinfo));
    in_pktinfo info{};
    info.ipi_spec_dst.s_addr = htonl(to.own_address);
    std::memcpy(CMSG_DATA(header), &info, sizeof info);
  }
  static_cast<void>(sendmsg(socket_, &message, 0));
}

std::optional<std::vector<uint8_t>> DatagramSocket::receive(std::chrono::milliseconds timeout, Endpoint& from) const {
  std::array<pollfd, 2> watched{pollfd{socket_, POLLIN, 0}, pollfd{waker_, POLLIN, 0}};
  if (poll(watched.data(), watched.size(), static_cast<int>(timeout.count())) <= 0) return std::nullopt;
  if (watched[1].revents != 0) {
    uint64_t count = 0;
    static_cast<void>(!read(waker_, &count, sizeof count));
    return std::nullopt;
  }
  std::vector<uint8_t> bytes(kMostDatagramBytes);
  sockaddr_in address{};
  iovec part{bytes.data(), bytes.size()};
  alignas(cmsghdr) std::array<uint8_t, CMSG_SPACE(sizeof(in_pktinfo))> control{};
  msghdr message{};
  message.msg_name = &address;
  message.msg_namelen = sizeof address;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = recvmsg(socket_, &message, 0);
  if (got < 0) return std::nullopt;  // an ICMP error of something sent before counts as nothing
  bytes.resize(static_cast<size_t>(got));
  from = endpointOf(address);
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != IPPROTO_IP || header->cmsg_type != IP_PKTINFO) continue;
    in_pktinfo info;
    std::memcpy(&info, CMSG_DATA(header), sizeof info);
    from.own_address = ntohl(info.ipi_spec_dst.s_addr);
  }
  return bytes;
}

void DatagramSocket::wake() const {
  const uint64_t one = 1;
  static_cast<void>(!write(waker_, &one, sizeof one));
}

}  // namespace comap
