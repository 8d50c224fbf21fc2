// A link whose closing does not hold its owner for ever. Inside the link only.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "protocol/link/link.h"

namespace comap {

/// Closes `link` from a thread of its own. If that takes longer than `patience` (Fast DDS 2.9 can lock itself up while
/// a peer leaves), it is given up and left open with all it has, `notice` is told, and the program will end without the
/// library's own clearing up, which would wait as well. Thread rule: as Link.
class BoundedLink : public Link {
 public:
  BoundedLink(std::shared_ptr<Link> link, std::chrono::milliseconds patience,
              std::function<void(const std::string&)> notice)
      : link_(std::move(link)), patience_(patience), notice_(std::move(notice)) {}
  ~BoundedLink() override;

  Result<void> publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) override {
    return link_->publish(topic, robot, payload);
  }
  bool delivered(Topic topic, const std::string& robot) const override { return link_->delivered(topic, robot); }
  std::optional<Delivery> receive(std::chrono::milliseconds timeout) override { return link_->receive(timeout); }
  int peers() const override { return link_->peers(); }
  std::string trouble() const override { return link_->trouble(); }
  std::string elder() const override { return link_->elder(); }
  bool knowsCores() const override { return link_->knowsCores(); }
  void serve() override { link_->serve(); }

 private:
  std::shared_ptr<Link> link_;
  const std::chrono::milliseconds patience_;
  const std::function<void(const std::string&)> notice_;
};

}  // namespace comap
