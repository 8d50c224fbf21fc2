// The robot's encoded keyframes, each kept until the core has said that it is durable there: in one file, over all
// starts of the agent, or, if asked for, in memory.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocol/codec/keyframe_codec.h"
#include "protocol/storage/database.h"
#include "protocol/types/messages.h"
#include "protocol/types/result.h"

namespace comap {

/// A keyframe of this robot, in whichever life of its agent it was made.
struct OutboxKey {
  uint64_t session = 0;
  uint32_t sequence = 0;
  auto operator<=>(const OutboxKey&) const = default;
};

/// What the outbox knows of a keyframe without decoding it.
struct OutboxRow {
  OutboxKey key;
  uint64_t bytes = 0;
  bool sent = false;     ///< the core may hold it already: it must stay as it is
  bool thinned = false;  ///< its colour was packed more tightly
  Pose T_odom_cam;
  KeyframeLink link;
  uint32_t skipped = 0;
};

/// Thread rule: one thread. Errors of the file: kUnreachable (full, no rights, in use by another agent), kBadData
/// (damaged). After one, what was there before is still there.
class Outbox {
 public:
  /// Opens or makes `path`, whose folder must exist. Waits half a second for another process that holds it.
  static Result<Outbox> open(const std::string& path);
  static Result<Outbox> inMemory();

  /// Says whose it is; one that says nothing yet is taken over with the keyframes of this robot. kWrongUse if it is
  /// another robot's.
  Result<void> belongTo(const std::string& robot);

  /// A session number above all that this outbox has given, `wished` if that is; it is durable when this returns.
  Result<uint64_t> beginSession(uint64_t wished);

  /// The last number given; 0 if none was.
  Result<uint64_t> lastSession();

  /// Takes an encoded keyframe; row.bytes is set from it. kWrongUse if one of that key is there.
  Result<void> add(const OutboxRow& row, std::span<const uint8_t> encoded);
  /// kBadData if what is read is not what was written; kProblem if there is none.
  Result<std::vector<uint8_t>> encoded(const OutboxKey& key);
  /// The first keyframe of the session from `from` on that the core does not hold yet.
  Result<std::optional<OutboxRow>> firstFrom(uint64_t session, uint32_t from);
  Result<std::optional<OutboxRow>> last(uint64_t session);
  /// Those of one session, in order, from `from` on, `most` at most: a page at a time, whatever the backlog.
  Result<std::vector<OutboxRow>> rows(uint64_t session, uint32_t from, size_t most);
  /// Those of the same session whose link goes to `key`, which need not be there.
  Result<std::vector<OutboxRow>> linkedTo(const OutboxKey& key);
  /// The oldest that was not sent and whose colour was not thinned.
  Result<std::optional<OutboxRow>> oldestUnthinned();

  Result<void> markSent(const OutboxKey& key);
  /// Writes a keyframe that is there anew.
  Result<void> replace(const OutboxRow& row, std::span<const uint8_t> encoded);
  Result<void> remove(const OutboxKey& key);
  /// What the core holds of the session that the acknowledgement is about counts no more. Returns their keys. They are
  /// in the file until takeOutDelivered().
  Result<std::vector<OutboxKey>> acknowledge(const Acknowledgement& acknowledgement);
  /// Deletes what was acknowledged. If the disk takes nothing, not even that, they stay until another call; a start
  /// that finds them there sends them once more, which the core takes no notice of.
  Result<void> takeOutDelivered();
  const std::set<OutboxKey>& deliveredButThere() const { return delivered_; }
  /// What another outbox of these keyframes knows to be at the core.
  Result<void> knowDelivered(const std::set<OutboxKey>& keys);

  /// Several changes as one: durable when committed, undone if that never comes. May be nested; the outermost counts.
  class Change;
  Result<Change> begin();

  /// The file does not grow beyond this, whatever is added: kUnreachable then, as on a full disk.
  Result<void> limitBytes(uint64_t bytes);

  size_t size() const;
  size_t size(uint64_t session) const;
  /// Of the messages and of what is kept beside them.
  uint64_t bytes() const { return bytes_; }
  /// Those that have keyframes here, ascending.
  std::vector<uint64_t> sessions() const;
  const std::string& path() const { return database_.path(); }

 private:
  explicit Outbox(Database database) : database_(std::move(database)) {}
  Result<void> prepare();
  Result<void> countAll();
  void count(uint64_t session, int keyframes, int64_t bytes);
  void deliver(const OutboxKey& key, int64_t bytes);
  Result<void> deliverIfThere(const OutboxKey& key);
  Result<void> erase(const OutboxKey& key);

  Database database_;
  std::map<uint64_t, size_t> keyframes_;  // of each session
  uint64_t bytes_ = 0;
  std::set<OutboxKey> delivered_;  // are in the file still, but not counted
};

class Outbox::Change {
 public:
  Change(Change&& other) noexcept
      : outbox_(other.outbox_),
        transaction_(std::move(other.transaction_)),
        before_(std::exchange(other.before_, std::nullopt)) {}
  Change& operator=(Change&&) = delete;
  ~Change();
  Result<void> commit();

 private:
  friend class Outbox;
  Change(Outbox& outbox, Transaction transaction);
  Outbox& outbox_;
  Transaction transaction_;
  std::optional<std::pair<std::map<uint64_t, size_t>, uint64_t>> before_;  // what was counted; nothing once committed
};

struct RescuedOutbox {
  Outbox outbox;
  std::string told;             ///< one line for the log: the names of both files, and numbers
  std::vector<OutboxRow> lost;  ///< known, but their message was damaged
  bool holes = false;           ///< places could not be read: there may have been more
};

/// Puts a damaged outbox aside, as `path`.damaged-1 or the next free number, and opens a new one with all keyframes
/// that could still be read and are whole, before and behind what is damaged. What was linked to a lost one is linked
/// to what that was linked to. kUnreachable if the file cannot be put aside, or its keyframes not be written anew (a
/// full disk): then it is where it was.
Result<RescuedOutbox> rescueOutbox(const std::string& path);

}  // namespace comap
