// What systemd, or whatever else has started the program as a service, is told: ready, alive, what it does, stopping.
#pragma once

#include <string>

namespace comap {

/// Says nothing unless NOTIFY_SOCKET names somebody to tell. Thread rule: one thread.
class ServiceManager {
 public:
  /// The program is up, and alive. `state` is one line for people.
  void alive(const std::string& state);
  /// The end has begun and may take up to `seconds`.
  void stopping(int seconds);

 private:
  bool told_ready_ = false;
  std::string told_state_;
};

}  // namespace comap
