#include "protocol/link/bounded_link.h"

#include <stdlib.h>
#include <unistd.h>

#include <cstdio>
#include <future>
#include <thread>

namespace comap {
namespace {

// What is registered last is called first: before the destructors that would wait.
void endWithoutClearingUp() {
  static const int registered = on_exit(
      [](int status, void*) {
        std::fflush(nullptr);
        _exit(status);
      },
      nullptr);
  static_cast<void>(registered);
}

}  // namespace

BoundedLink::~BoundedLink() {
  std::promise<void> closed;
  const auto done = closed.get_future();
  std::thread([link = std::move(link_), closed = std::move(closed)]() mutable {
    link.reset();
    closed.set_value();
  }).detach();
  if (done.wait_for(patience_) == std::future_status::ready) return;
  endWithoutClearingUp();
  if (notice_)
    notice_("the link does not close within " + std::to_string(patience_.count() / 1000) +
            " s (a known lock within Fast DDS 2.9) and is given up; what is not acknowledged is sent again");
}

}  // namespace comap
