// Who has announced itself, and whom that is told. Values in, values out: sockets and threads are the server's.
#pragma once

#include <chrono>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "protocol/discovery/endpoint.h"
#include "protocol/discovery/note.h"

namespace comap {

class Introductions {
 public:
  using Clock = std::chrono::steady_clock;
  struct Outgoing {
    Endpoint to;
    std::vector<uint8_t> bytes;
  };

  /// `secret`: of this server alone, new with each start. `tell` gets a line for each who comes and goes.
  Introductions(std::array<uint8_t, 32> secret, std::function<void(const std::string&)> tell)
      : secret_(secret), tell_(std::move(tell)) {}

  /// What is to be sent because `bytes` came. Nobody gets more than he sent before he has shown that he receives at
  /// `from`, so that the server is no use for flooding others.
  std::vector<Outgoing> take(const Endpoint& from, std::span<const uint8_t> bytes, Clock::time_point now);

  /// How many are there now.
  size_t members() const;

 private:
  struct Member {
    MemberRole role;
    std::vector<uint8_t> announcement;
    Clock::time_point heard, told;
    bool news = false;  ///< the others have been told something older of it
    bool gone = false;  ///< has left; keeps its place for a while, so that leaving and coming again floods nobody
  };
  using Key = std::pair<SiteCode, Endpoint>;

  std::vector<Outgoing> announce(const Endpoint& from, const Note& note, Clock::time_point now);
  void leave(const Key& who, Clock::time_point now);
  std::vector<Outgoing> introduce(const Key& who, const Member& member) const;
  static std::vector<uint8_t> introductionOf(const SiteCode& site, const Member& member);
  std::vector<uint8_t> answer(const SiteCode& site) const;
  Cookie cookieOf(const Endpoint& endpoint, const SiteCode& site) const;
  bool isRoomFor(const Endpoint& from, const SiteCode& site) const;
  void forgetSilent(Clock::time_point now);
  /// Those of the site that are there.
  template <class Visit>
  void forSite(const SiteCode& site, Visit visit) const;

  const std::array<uint8_t, 32> secret_;
  const std::function<void(const std::string&)> tell_;
  std::map<Key, Member> members_;
  Clock::time_point looked_{};
};

}  // namespace comap
