#include "protocol/link/loopback_link.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <list>
#include <mutex>

#include "protocol/link/topics.h"

namespace comap {
namespace {

constexpr size_t kMaxWaitingBytes = size_t{1} << 30;

}  // namespace

struct LoopbackHub::State {
  struct Latched {
    const Endpoint* writer;
    Delivery delivery;
  };
  std::mutex mutex;
  std::condition_variable arrived;
  std::list<Endpoint*> endpoints;  // in order of connection
  std::list<Latched> latched;      // in order of publication
};

class LoopbackHub::Endpoint : public Link {
 public:
  Endpoint(std::shared_ptr<State> state, LinkRole role, std::string robot)
      : state_(std::move(state)), role_(role), robot_(std::move(robot)) {
    const std::lock_guard lock(state_->mutex);
    state_->endpoints.push_back(this);
    for (const State::Latched& last : state_->latched) {
      if (wants(last.delivery)) push(last.delivery);
    }
  }

  ~Endpoint() override {
    const std::lock_guard lock(state_->mutex);
    state_->endpoints.remove(this);
    state_->latched.remove_if([this](const State::Latched& last) { return last.writer == this; });
  }

  Result<void> publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) override {
    if (auto allowed = checkPublish(role_, robot_, topic, robot, payload.size()); !allowed) return allowed;
    const Delivery delivery{topic, robot, {payload.begin(), payload.end()}};
    const std::lock_guard lock(state_->mutex);
    for (const Endpoint* reader : state_->endpoints) {
      if (reader->wants(delivery) && reader->waiting_bytes_ + payload.size() > kMaxWaitingBytes) {
        return Error{ErrorCode::kUnreachable,
                     topicName(topic) + ": " + roleName(reader->role_) + " '" + reader->robot_ + "' has let " +
                         std::to_string(reader->waiting_bytes_) + " bytes wait and takes no more"};
      }
    }
    if (latchedDepth(topic) > 0) latch(delivery);
    for (Endpoint* reader : state_->endpoints) {
      if (reader->wants(delivery)) reader->push(delivery);
    }
    state_->arrived.notify_all();
    return {};
  }

  bool delivered(Topic, const std::string&) const override { return true; }

  std::optional<Delivery> receive(std::chrono::milliseconds timeout) override {
    std::unique_lock lock(state_->mutex);
    if (!state_->arrived.wait_for(lock, timeout, [this] { return !waiting_.empty(); })) return std::nullopt;
    Delivery delivery = std::move(waiting_.front());
    waiting_.pop_front();
    waiting_bytes_ -= delivery.payload.size();
    return delivery;
  }

  int peers() const override {
    const std::lock_guard lock(state_->mutex);
    const LinkRole other = role_ == LinkRole::kCore ? LinkRole::kRobot : LinkRole::kCore;
    int count = 0;
    for (const Endpoint* endpoint : state_->endpoints) count += endpoint->role_ == other ? 1 : 0;
    return count;
  }

 private:
  bool wants(const Delivery& delivery) const {
    const bool own_alone =
        role_ == LinkRole::kRobot || (role_ == LinkRole::kObserver && isForNamedObservers(delivery.topic));
    return reads(role_, delivery.topic) && (!own_alone || delivery.robot == robot_);
  }
  // The oldest of the same topic and robot makes room once there are as many as late joiners get.
  void latch(const Delivery& delivery) {
    const auto alike = [&](const State::Latched& last) {
      return last.writer == this && last.delivery.topic == delivery.topic && last.delivery.robot == delivery.robot;
    };
    auto& latched = state_->latched;
    const auto held = static_cast<size_t>(std::count_if(latched.begin(), latched.end(), alike));
    if (held >= latchedDepth(delivery.topic)) latched.erase(std::find_if(latched.begin(), latched.end(), alike));
    latched.push_back({this, delivery});
  }
  void push(const Delivery& delivery) {
    waiting_bytes_ += delivery.payload.size();
    waiting_.push_back(delivery);
  }

  std::shared_ptr<State> state_;
  const LinkRole role_;
  const std::string robot_;
  std::deque<Delivery> waiting_;
  size_t waiting_bytes_ = 0;
};

LoopbackHub::LoopbackHub() : state_(std::make_shared<State>()) {}

std::unique_ptr<Link> LoopbackHub::connect(LinkRole role, const std::string& robot) {
  return std::make_unique<Endpoint>(state_, role, robot);
}

}  // namespace comap
