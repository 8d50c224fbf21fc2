#include "protocol/link/roaming_link.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>

#include <thread>

namespace comap {
namespace {

constexpr std::chrono::seconds kLookEvery{1};

}  // namespace

std::string ownAddress(const std::string& interface) {
  if (interface.starts_with("127.")) return interface == "127.0.0.1" ? interface : "";
  ifaddrs* interfaces = nullptr;
  if (getifaddrs(&interfaces) != 0) return {};
  std::string found;
  for (const ifaddrs* entry = interfaces; entry != nullptr && found.empty(); entry = entry->ifa_next) {
    if (entry->ifa_addr == nullptr || entry->ifa_addr->sa_family != AF_INET) continue;
    // On an interface that is down DDS would be deaf for good, whatever becomes of the interface.
    if ((entry->ifa_flags & (IFF_UP | IFF_RUNNING)) != (IFF_UP | IFF_RUNNING)) continue;
    char text[INET_ADDRSTRLEN];
    const auto* address = reinterpret_cast<const sockaddr_in*>(entry->ifa_addr);
    if (inet_ntop(AF_INET, &address->sin_addr, text, sizeof text) == nullptr) continue;
    if (interface == entry->ifa_name || interface == text) found = text;
  }
  freeifaddrs(interfaces);
  return found;
}

Result<void> RoamingLink::follow() {
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (looked_ != std::chrono::steady_clock::time_point() && now - looked_ < kLookEvery) return {};
  looked_ = now;
  if (revocations_ && revocations_->look() != Revocations::News::kNone) link_.reset();
  if (revocations_ && !revocations_->barred().empty()) return {};
  const std::string address = address_now_();
  if (address == address_ && (link_ || address.empty())) return {};
  link_.reset();
  address_ = address;
  if (address.empty()) return {};
  auto link = connect_(address, revocations_ ? revocations_->list() : "");
  if (!link) return link.error();
  link_ = std::move(*link);
  if (serves_) link_->serve();
  return {};
}

Result<void> RoamingLink::publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) {
  const auto link = current();
  if (link) return link->publish(topic, robot, payload);
  const std::lock_guard lock(mutex_);
  return Error{ErrorCode::kUnreachable, absence()};
}

bool RoamingLink::delivered(Topic topic, const std::string& robot) const {
  const std::lock_guard lock(mutex_);
  return !link_ || link_->delivered(topic, robot);
}

std::optional<Delivery> RoamingLink::receive(std::chrono::milliseconds timeout) {
  if (const auto link = current()) return link->receive(timeout);
  std::this_thread::sleep_for(timeout);
  return std::nullopt;
}

int RoamingLink::peers() const {
  const std::lock_guard lock(mutex_);
  return link_ ? link_->peers() : 0;
}

std::string RoamingLink::trouble() const {
  const std::lock_guard lock(mutex_);
  return link_ ? link_->trouble() : absence();
}

std::string RoamingLink::elder() const {
  const std::lock_guard lock(mutex_);
  return link_ ? link_->elder() : std::string();
}

bool RoamingLink::knowsCores() const {
  const std::lock_guard lock(mutex_);
  return !link_ || link_->knowsCores();
}

void RoamingLink::serve() {
  const std::lock_guard lock(mutex_);
  serves_ = true;
  if (link_) link_->serve();
}

// Why there is no link; with mutex_ held.
std::string RoamingLink::absence() const {
  if (revocations_ && !revocations_->barred().empty()) return revocations_->barred();
  return address_.empty() ? "interface " + interface_ + " has no IPv4 address now"
                          : "the link on " + address_ + " could not be opened again";
}

std::shared_ptr<Link> RoamingLink::current() {
  (void)bool(follow());  // tried again after kLookEvery
  const std::lock_guard lock(mutex_);
  return link_;
}

}  // namespace comap
