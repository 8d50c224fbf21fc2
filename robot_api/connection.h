// A program's end of the local socket: one question, one answer, each in its time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "robot_api/wire.h"

namespace comap::robot_api {

/// What went wrong; `code` is one of comap_robot.h's, negative.
struct Failure {
  int code = 0;
  std::string text;
};

/// A value, or why there is none.
template <class T>
using Outcome = std::variant<T, Failure>;

struct Message {
  Kind kind{};
  std::vector<uint8_t> body;
};

/// After a failure in the middle of an answer nobody knows where the next one begins, so the connection is then closed.
/// Thread rule: one thread.
class Connection {
 public:
  using Clock = std::chrono::steady_clock;

  Connection() = default;
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() { close(); }

  std::optional<Failure> open(const std::string& path, Clock::time_point until);
  void close();
  bool isOpen() const { return fd_ >= 0; }
  const Greeting& greeting() const { return greeting_; }

  /// Sends a frame. What an agent said unasked is its farewell, which is then the failure.
  std::optional<Failure> send(const std::string& frame, Clock::time_point until);
  /// The next message; a refusal is a failure, after which the connection is of use all the same.
  Outcome<Message> receive(Clock::time_point until);
  /// Closes the connection and tells why.
  Failure broken(int code, const std::string& text);

 private:
  std::optional<Failure> await(short events, Clock::time_point until);
  std::optional<Failure> read(std::span<uint8_t> to, Clock::time_point until);

  int fd_ = -1;
  std::string path_;
  Greeting greeting_;
};

}  // namespace comap::robot_api
