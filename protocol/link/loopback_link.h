// Robots, core and observers in one process: everything arrives at once, in the order it was published.
#pragma once

#include <memory>
#include <string>

#include "protocol/link/link.h"

namespace comap {

/// The wire between the links it makes; lives as long as any of them. Needs no thread, and may be used from several.
class LoopbackHub {
 public:
  LoopbackHub();

  /// A new endpoint. A robot needs its name; others may leave it empty. Like every late joiner it finds the last
  /// message of each latched topic and robot waiting, in the order they were published.
  /// Its publish never blocks: kUnreachable if a reader has let more than 1 GiB pile up.
  std::unique_ptr<Link> connect(LinkRole role, const std::string& robot = "");

 private:
  struct State;
  class Endpoint;
  std::shared_ptr<State> state_;
};

}  // namespace comap
