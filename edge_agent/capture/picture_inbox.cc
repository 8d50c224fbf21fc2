#include "edge_agent/capture/picture_inbox.h"

namespace comap {
namespace {

constexpr size_t kKept = 8;

}  // namespace

void PictureInbox::put(PictureKind kind, Picture picture, const StreamHealth& health) {
  {
    const std::lock_guard lock(mutex_);
    Slot& into = slot(kind);
    into.health = health;
    into.pictures.push_back(std::move(picture));
    if (into.pictures.size() > kKept) {
      into.pictures.pop_front();
      ++into.pushed_out;
    }
    news_ = true;
  }
  bell_.notify_one();
}

void PictureInbox::tell(PictureKind kind, const StreamHealth& health) {
  {
    const std::lock_guard lock(mutex_);
    Slot& into = slot(kind);
    news_ = news_ || into.health.state != health.state;
    into.health = health;
  }
  bell_.notify_one();
}

std::vector<Picture> PictureInbox::take(PictureKind kind) {
  const std::lock_guard lock(mutex_);
  auto& from = slot(kind).pictures;
  std::vector<Picture> taken(std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  from.clear();
  return taken;
}

StreamHealth PictureInbox::health(PictureKind kind) const {
  const std::lock_guard lock(mutex_);
  return slot(kind).health;
}

uint64_t PictureInbox::pushedOut(PictureKind kind) const {
  const std::lock_guard lock(mutex_);
  return slot(kind).pushed_out;
}

bool PictureInbox::waitForNews(std::chrono::steady_clock::time_point until) {
  std::unique_lock lock(mutex_);
  const bool came = bell_.wait_until(lock, until, [this] { return news_; });
  news_ = false;
  return came;
}

}  // namespace comap
