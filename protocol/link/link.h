// One wire between robots and core. Two bodies: DdsLink (Fast DDS) and LoopbackLink (one process, fixed order).
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

enum class Topic : uint8_t {
  kHello,
  kKeyframe,
  kAck,
  kCorrection,
  kInterest,
  kTile,
  kStatus,
  kVerdict,
  kMerge,
  kCoreStatus,
};

/// Decides which topics an endpoint writes and which it reads (docs/wire.md). An observer reads all that goes to all.
enum class LinkRole : uint8_t { kRobot, kCore, kObserver };

struct Delivery {
  Topic topic = Topic::kHello;
  std::string robot;  ///< the topic's key: which robot it is from or for; empty: to all
  std::vector<uint8_t> payload;
};

/// Thread rule: publish and receive may be called from different threads, each from one at a time.
class Link {
 public:
  virtual ~Link() = default;

  /// Hands one encoded message to the wire. kUnreachable if it has no room: keyframes are waited with for a while.
  virtual Result<void> publish(Topic topic, const std::string& robot, std::span<const uint8_t> payload) = 0;

  /// Whether all that was published so has reached those at the other end who were there; not that they took it.
  virtual bool delivered(Topic topic, const std::string& robot) const = 0;

  /// The next message of the topics this role reads (a robot: only those keyed with its own name),
  /// in order of arrival. Waits up to `timeout`.
  virtual std::optional<Delivery> receive(std::chrono::milliseconds timeout) = 0;

  /// Peers seen at the other end now: cores for a robot, robots for a core.
  virtual int peers() const = 0;

  /// What is known to keep peers from being found, in a sentence; empty if nothing is.
  virtual std::string trouble() const { return {}; }

  /// Of a core: the other core of its site to which it is to give way, in words; empty as long as none is known. Of two
  /// the one stays that serves; of two that both do, or both do not yet, the one that began earlier.
  virtual std::string elder() const { return {}; }

  /// Of a core: whether it is clear of all cores in sight if they are of its site.
  virtual bool knowsCores() const { return true; }

  /// Of a core: it serves from now on. Others are told.
  virtual void serve() {}
};

}  // namespace comap
