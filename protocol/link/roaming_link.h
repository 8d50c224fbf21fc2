// A link that is opened anew when what it was opened with is no longer so: the address of a network interface that is
// given by name, or the list of revoked keys.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "protocol/link/link.h"
#include "protocol/link/revocations.h"

namespace comap {

/// The IPv4 address of the interface that has this address or this name; empty if there is none now, or it is down. Of
/// 127.* only 127.0.0.1 is one.
std::string ownAddress(const std::string& interface);

/// While the interface has no address, or the own key is revoked, nobody is there and publish is kUnreachable. Peers
/// see a participant go and another come; what was under way is lost, as with a core or robot that is started anew.
/// Thread rule: as Link.
class RoamingLink : public Link {
 public:
  /// Opens a link on an address, with the list of revoked keys that is in force (Revocations::list()).
  using Connect = std::function<Result<std::unique_ptr<Link>>(const std::string& address, const std::string& revoked)>;
  /// The address now; empty if there is none.
  using Address = std::function<std::string()>;
  RoamingLink(std::string interface, Address address, Connect connect, std::optional<Revocations> revocations = {})
      : interface_(std::move(interface)),
        address_now_(std::move(address)),
        connect_(std::move(connect)),
        revocations_(std::move(revocations)) {}

  /// Looks for the address and the list of revoked keys, once a second at most, and connects anew if they are others.
  /// Errors are `connect`'s; the other calls begin with it, and try again later.
  Result<void> follow();

  Result<void> publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) override;
  bool delivered(Topic topic, const std::string& robot) const override;
  std::optional<Delivery> receive(std::chrono::milliseconds timeout) override;
  int peers() const override;
  std::string trouble() const override;
  std::string elder() const override;
  bool knowsCores() const override;
  void serve() override;

 private:
  std::shared_ptr<Link> current();

  std::string absence() const;

  const std::string interface_;
  const Address address_now_;
  const Connect connect_;
  mutable std::mutex mutex_;
  std::optional<Revocations> revocations_;
  std::shared_ptr<Link> link_;
  std::string address_;
  bool serves_ = false;
  std::chrono::steady_clock::time_point looked_{};
};

}  // namespace comap
