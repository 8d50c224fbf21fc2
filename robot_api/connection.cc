#include "robot_api/connection.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "protocol/types/local_socket.h"
#include "robot_api/comap_robot.h"

namespace comap::robot_api {
namespace {

std::string nameOf(int problem) {
  std::array<char, 128> text{};
  return ::strerror_r(problem, text.data(), text.size());  // strerror is not for several threads
}

static_assert(kUnreachable == COMAP_ROBOT_UNREACHABLE && kBadData == COMAP_ROBOT_BAD_DATA &&
              kTooLarge == COMAP_ROBOT_TOO_LARGE);

}  // namespace

std::optional<Failure> Connection::open(const std::string& path, Clock::time_point until) {
  close();
  path_ = path;
  if (path.empty() || path.size() > kMostSocketPathBytes)
    return Failure{COMAP_ROBOT_WRONG_USE, "the path of the agent's socket has " + std::to_string(path.size()) +
                                              " bytes; 1 to " + std::to_string(kMostSocketPathBytes) +
                                              " are expected"};
  fd_ = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) return Failure{COMAP_ROBOT_UNREACHABLE, path + ": no socket: " + nameOf(errno)};
  while (connectSocket(fd_, path) != 0) {
    const int problem = errno;
    if (problem == EINTR) continue;
    if (problem != EAGAIN)  // the agent's queue of those who knock is full
      return broken(COMAP_ROBOT_UNREACHABLE,
                    "no agent answers: " + nameOf(problem) +
                        "; is it running with --api-socket, and may this user read and write it?");
    if (Clock::now() >= until) return broken(COMAP_ROBOT_UNREACHABLE, "the agent is too busy to answer");
    ::poll(nullptr, 0, 5);
  }
  auto first = receive(until);
  if (const auto* failure = std::get_if<Failure>(&first)) {
    const Failure why = *failure;
    close();
    return why;
  }
  const auto& message = std::get<Message>(first);
  if (message.kind != Kind::kGreeting) return broken(COMAP_ROBOT_BAD_DATA, "who answers is no edge_agent");
  auto greeting = decodeGreeting(message.body);
  if (!greeting) return broken(COMAP_ROBOT_BAD_DATA, greeting.error().text);
  greeting_ = std::move(*greeting);
  return std::nullopt;
}

void Connection::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

Failure Connection::broken(int code, const std::string& text) {
  close();
  return {code, path_ + ": " + text};
}

std::optional<Failure> Connection::await(short events, Clock::time_point until) {
  if (fd_ < 0) return Failure{COMAP_ROBOT_UNREACHABLE, "not connected"};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    pollfd polled{fd_, events, 0};
    const int n = ::poll(&polled, 1, static_cast<int>(std::clamp<decltype(left)>(left, 0, 60'000)));
    if (n > 0) return std::nullopt;
    if (n < 0 && errno != EINTR) return broken(COMAP_ROBOT_UNREACHABLE, nameOf(errno));
    if (n == 0 && Clock::now() >= until)
      return broken(COMAP_ROBOT_UNREACHABLE, "the agent did not answer in time; the connection is closed");
  }
}

std::optional<Failure> Connection::send(const std::string& frame, Clock::time_point until) {
  for (size_t sent = 0; sent < frame.size();) {
    if (auto failure = await(POLLOUT, until)) return failure;
    const ssize_t n = ::send(fd_, frame.data() + sent, frame.size() - sent, MSG_NOSIGNAL);
    if (n > 0) sent += static_cast<size_t>(n);
    if (n < 0 && errno == EPIPE) {
      const auto farewell = receive(until);
      close();
      if (const auto* why = std::get_if<Failure>(&farewell)) return *why;
      return Failure{COMAP_ROBOT_UNREACHABLE, path_ + ": the agent has gone"};
    }
    if (n < 0 && errno != EAGAIN && errno != EINTR) return broken(COMAP_ROBOT_UNREACHABLE, nameOf(errno));
  }
  return std::nullopt;
}

std::optional<Failure> Connection::read(std::span<uint8_t> to, Clock::time_point until) {
  while (!to.empty()) {
    if (auto failure = await(POLLIN, until)) return failure;
    const ssize_t n = ::recv(fd_, to.data(), to.size(), 0);
    if (n == 0) return broken(COMAP_ROBOT_UNREACHABLE, "the agent has gone");
    if (n > 0) to = to.subspan(static_cast<size_t>(n));
    if (n < 0 && errno != EAGAIN && errno != EINTR) return broken(COMAP_ROBOT_UNREACHABLE, nameOf(errno));
  }
  return std::nullopt;
}

Outcome<Message> Connection::receive(Clock::time_point until) {
  std::array<uint8_t, kHeaderBytes> bytes{};
  if (auto failure = read(bytes, until)) return *failure;
  const auto header = decodeHeader(bytes, kMaxAnswerBytes);
  if (!header) return broken(COMAP_ROBOT_BAD_DATA, header.error().text);
  Message message{static_cast<Kind>(header->kind), std::vector<uint8_t>(header->body_bytes)};
  if (auto failure = read(message.body, until)) return *failure;
  if (message.kind != Kind::kRefusal) return message;
  const auto refusal = decodeRefusal(message.body);
  if (!refusal) return broken(COMAP_ROBOT_BAD_DATA, refusal.error().text);
  const bool known = refusal->code < 0 && refusal->code >= COMAP_ROBOT_NO_MEMORY;
  return Failure{known ? refusal->code : COMAP_ROBOT_BAD_DATA, path_ + ": " + refusal->sentence};
}

}  // namespace comap::robot_api
