// The maps' current tiles, and who gets which of them.
#pragma once

#include <chrono>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "mapping_core/ingest/robot_registry.h"
#include "mapping_core/tiles/tile_downlink.h"
#include "mapping_core/tiles/tile_index.h"
#include "protocol/link/link.h"

namespace comap {

/// Sends to each robot, and to each program that looks on, what it lacks of the tiles around it: when it asks, and when
/// tiles have changed of a map that it asked for lately. What does not fit at once goes to robots as soon as it does;
/// what does not get through, with the next interest. Errors are of tiles that cannot be encoded. Thread rule: one
/// thread.
class TileDelivery {
 public:
  /// `paced`: tiles go no faster than their arrival is reported; else by the robots' budgets alone, without looking at
  /// a clock.
  TileDelivery(Link& link, bool paced) : link_(link), paced_(paced) {}

  /// Revisions begin above `revision`, and no tile is held: the first thing in the life of a core.
  void beginAbove(uint64_t revision) { index_ = TileIndex(revision); }

  /// A robot's interest; `record` is its own. Nothing goes to a robot whose place the core does not know yet.
  Result<void> answer(RobotRecord& record, const Interest& interest);
  /// The interest of who only looks on: in no map and without a session, it asks for each map apart.
  Result<void> answerObserver(const Interest& interest);

  /// Takes changed tiles of `map`, as TileIndex::change(), and sends them to those of `robots` that have asked lately.
  Result<void> renew(const MapId& map, std::vector<Tile> changed, const RobotRegistry& robots);
  /// Goes on sending to those who have not got all yet.
  Result<void> goOn(const RobotRegistry& robots);
  /// Whether goOn() may have something to do soon.
  bool unfinished() const;
  /// For traces: what all tiles add up to, if they have changed since this was last noted. Takes a while.
  void noteHashes();
  /// A map that was absorbed.
  void drop(const MapId& map);

  const TileIndex& tiles() const { return index_; }
  const std::map<std::string, uint64_t>& sentBytes() const { return sent_bytes_; }  ///< payload, by receiver

 private:
  using Clock = TileDownlink::Clock;
  struct Receiver {
    TileDownlink downlink;
    std::vector<TileDue> due;  // what it lacked when it was last asked
    size_t next = 0;           // of these
    Clock::time_point full_until{};
    bool hasDue() const { return next < due.size(); }
  };
  struct Observer {
    Receiver receiver;
    Clock::time_point asked{};
  };
  struct Encoded {
    uint64_t revision = 0;
    std::vector<uint8_t> bytes;
  };
  MapPose wantedAt(const Interest& interest, const Correction& correction) const;
  void plan(const Interest& interest, const MapPose& at, std::span<const HeldTile> held, Receiver& to) const;
  void planRobot(const Interest& interest, const MapPose& at, std::span<const HeldTile> held, Receiver& to) const;
  Result<void> push(const MapId& map, const RobotRegistry& robots);
  Result<void> send(const Interest& interest, Receiver& to);
  bool mayGo(const Interest& interest, Receiver& to, size_t bytes, size_t sent) const;
  Result<std::span<const uint8_t>> encodedOf(const Tile& tile, bool coarse);

  Link& link_;
  bool paced_;
  TileIndex index_;
  std::map<std::string, Receiver> receivers_;                    // by robot
  std::map<std::pair<std::string, MapId>, Observer> observers_;  // by name and map asked for
  std::map<std::string, uint64_t> sent_bytes_;
  std::map<std::pair<TileKey, bool>, Encoded> encoded_;  // coarse or not; what went to one robot mostly goes to others
  size_t encoded_bytes_ = 0;
  uint64_t hashed_ = 0;  // revision of the last noteHashes()
};

}  // namespace comap
