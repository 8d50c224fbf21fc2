// Which robots are there, and which have orderly gone, as the store knows: so that a core that continues it knows whom
// to miss.
#pragma once

#include <map>
#include <string>

#include "mapping_core/service/store_health.h"
#include "mapping_core/store/map_store.h"

namespace comap {

/// Thread rule: as the store's.
class PresenceBook {
 public:
  PresenceBook(MapStore& store, StoreHealth& health) : store_(store), health_(health) {}

  /// Takes over what an earlier core has written. Call it first.
  Result<void> resume();
  /// Writes what is new. A store that takes nothing is told with the robot's next word.
  void note(const std::string& robot, bool present);
  /// By robot: here, or orderly gone.
  const std::map<std::string, bool>& robots() const { return present_; }

 private:
  MapStore& store_;
  StoreHealth& health_;
  std::map<std::string, bool> present_;
};

}  // namespace comap
