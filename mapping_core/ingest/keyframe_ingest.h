// Keyframes from the wire into the store, each once, and from there to the mapper in the order they were taken.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "mapping_core/store/map_store.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/keyframe_link.h"

namespace comap {

/// Thread rule: one thread.
class KeyframeIngest {
 public:
  explicit KeyframeIngest(MapStore& store) : store_(store) {}

  /// Takes over what the store holds, in order of arrival; those with a map are mapped already. Call it first.
  /// Returns those that will never come, as their robots said.
  Result<std::vector<KeyframeId>> resume(std::span<const StoredKeyframe> keyframes);

  struct Arrival {
    KeyframeId id;
    bool is_new = false;
    std::vector<KeyframeId> skipped;  ///< right before it: will never come
  };
  /// Checks and stores an encoded keyframe; it is durable when this returns. Duplicates are harmless.
  /// kBadData: it is damaged and was not stored. kUnreachable: the store does not take it.
  Result<Arrival> ingest(std::span<const uint8_t> encoded);

  /// Goes on without a keyframe that cannot be taken, and hangs on `link`: those behind it become ready. Should it come
  /// after all, it is ready at once. True if it is not there and this was not known.
  bool passOver(const KeyframeId& id, const KeyframeLink& link);
  /// Ties a keyframe that hangs on one that was passed over to what that one hangs on.
  void tieAcrossGaps(Keyframe& keyframe) const;

  /// The next keyframe to map: first come, first served, but of one session strictly by sequence, but for those that
  /// were passed over.
  bool hasNext() const { return !ready_.empty(); }
  KeyframeId takeNext();
  /// The keyframe itself, once, if it came lately and need not be read from the store and decoded again.
  std::optional<Keyframe> takeDecoded(const KeyframeId& id);
  size_t waiting() const;

 private:
  struct Session {
    uint32_t next = 0;                        // sequence to become ready next
    std::set<uint32_t> early;                 // stored, but something before them is missing
    std::set<uint32_t> skipped;               // not before `next`, and will never come
    std::map<uint32_t, KeyframeLink> passed;  // are not there and are not waited for, with what they hang on
  };
  using SessionName = std::pair<std::string, uint64_t>;
  void arrived(const KeyframeId& id, uint32_t skipped, const std::set<KeyframeId>& mapped);
  void advance(const SessionName& name, const std::set<KeyframeId>& mapped);
  void insertLate(const KeyframeId& id);
  void passOverAsBefore(const std::set<KeyframeId>& mapped);

  MapStore& store_;
  std::map<SessionName, Session> sessions_;
  std::deque<KeyframeId> ready_;
  std::map<KeyframeId, Keyframe> decoded_;  // the newest few
  std::deque<KeyframeId> decoded_order_;    // as they came, those taken among them
};

}  // namespace comap
