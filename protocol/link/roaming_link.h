// A link on a network interface that is given by name: the interface's address may come, go and change.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "protocol/link/link.h"

namespace comap {

/// The IPv4 address of the interface that has this address or this name; empty if there is none now. Of 127.* only
/// 127.0.0.1 is one.
std::string ownAddress(const std::string& interface);

/// While the interface has no address, nobody is there and publish is kUnreachable. Thread rule: as Link.
class RoamingLink : public Link {
 public:
  /// Opens a link on an address.
  using Connect = std::function<Result<std::unique_ptr<Link>>(const std::string& address)>;
  RoamingLink(std::string interface, Connect connect)
      : interface_(std::move(interface)), connect_(std::move(connect)) {}

  /// Looks for the interface's address, once a second at most, and connects anew if it is another. Errors are
  /// `connect`'s; the other calls begin with it, and try again later.
  Result<void> follow();

  Result<void> publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) override;
  bool delivered(Topic topic, const std::string& robot) const override;
  std::optional<Delivery> receive(std::chrono::milliseconds timeout) override;
  int peers() const override;
  std::string trouble() const override;

 private:
  std::shared_ptr<Link> current();

  const std::string interface_;
  const Connect connect_;
  mutable std::mutex mutex_;
  std::shared_ptr<Link> link_;
  std::string address_;
  std::chrono::steady_clock::time_point looked_{};
};

}  // namespace comap
