#include "mapping_core/service/store_health.h"

#include <algorithm>

namespace comap {

bool StoreHealth::holds() {
  const std::string trouble = file_.trouble();
  if (!trouble.empty()) note(Error{ErrorCode::kUnreachable, trouble});
  return trouble.empty();
}

bool StoreHealth::takes() {
  constexpr std::chrono::seconds kAgain(1);
  if (!holds()) return false;
  if (refuses() && std::chrono::steady_clock::now() - tried_ >= kAgain) note(store_.tryWriting(room_));
  return !refuses();
}

void StoreHealth::note(const Result<void>& written, size_t bytes) {
  tried_ = std::chrono::steady_clock::now();
  if (!written) room_ = std::max(room_, bytes);
  if (refuses() == !written) return;
  failure_ = written ? std::string() : written.error().text;
  if (written)
    log_(LogLevel::kInfo, "the store takes keyframes again");
  else
    log_(LogLevel::kError, "the store takes no keyframes: " + failure_ +
                               ". Robots keep theirs and send them again; mapping goes on when it does");
}

}  // namespace comap
