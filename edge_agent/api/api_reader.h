// One program that reads, seen from the agent: its question, and as much of the answer as it takes.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include "edge_agent/api/api_state.h"

namespace comap {

/// Never waits: what the program does not take now stays until it does, one piece of an answer at a time, so that a
/// reader costs the same memory however slow it is and however much it asks for. Time is passed in. Thread rule: one
/// thread.
class ApiReader {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kPatience{10};  ///< with one who takes nothing of its answer

  /// `fd` is a non-blocking connected socket, closed with the reader.
  ApiReader(int fd, const robot_api::Greeting& greeting, Clock::time_point now);
  ApiReader(ApiReader&& other) noexcept;
  ApiReader& operator=(ApiReader&& other) noexcept;
  ~ApiReader();

  /// Does what can be done without waiting, and no more than a turn's worth of it: others wait for theirs.
  void work(const ApiState& state, Clock::time_point now);

  /// The program has gone.
  void leave() { close(); }
  int descriptor() const { return fd_; }
  bool isOpen() const { return fd_ >= 0; }
  bool wantsToWrite() const { return unsent() || answer_ || last_words_; }
  bool wantsToRead() const { return !wantsToWrite() && !wait_; }
  /// When work() has something to do although nothing has come.
  std::optional<Clock::time_point> due() const;
  /// Why it was closed, for the log; empty if it left by itself.
  const std::string& reproach() const { return reproach_; }

 private:
  struct Wait {
    uint64_t after;
    Clock::time_point until;
  };
  struct Answer {
    std::shared_ptr<const TileSnapshot> snapshot;
    robot_api::AskSurfels box;
    size_t next = 0;
  };
  bool unsent() const { return written_ < out_.size(); }
  void close();
  void refuse(const std::string& reproach);
  bool write(Clock::time_point now);
  bool continueAnswer();
  bool answerWait(const ApiState& state, Clock::time_point now);
  bool readQuestion(const ApiState& state, Clock::time_point now);
  void take(uint16_t kind, std::span<const uint8_t> body, const ApiState& state, Clock::time_point now);
  void beginAnswer(const robot_api::AskSurfels& ask, const ApiState& state);
  void say(std::string frame);

  int fd_;
  std::string in_, out_;
  size_t written_ = 0;
  std::optional<Wait> wait_;
  std::optional<Answer> answer_;
  bool last_words_ = false;
  Clock::time_point last_progress_;
  std::string reproach_;
};

}  // namespace comap
