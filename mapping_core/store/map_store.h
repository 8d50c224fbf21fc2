// The truth on disk: keyframes as they came over the wire, edges, verdicts, merges, poses; and the derived tiles.
// One SQLite file (WAL). A call returns after its transaction is durable.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mapping_core/graph/edge.h"
#include "protocol/types/keyframe.h"
#include "protocol/types/messages.h"
#include "protocol/types/result.h"
#include "protocol/types/tile.h"

namespace comap {

/// A keyframe's row without its images.
struct StoredKeyframe {
  KeyframeId id;
  int64_t stamp_ns = 0;
  uint32_t arrival = 0;  ///< 0, 1, 2 ... in order of ingest
  MapId map;
  Pose T_map_cam;
  size_t bytes = 0;  ///< of the encoded keyframe
};

/// An edge that was accepted and went when a merge was undone.
struct WithdrawnEdge {
  Edge edge;
  uint32_t withdrawn_by = 0;  ///< number of that merge
};

/// Which verdicts are wanted.
struct VerdictFilter {
  std::optional<bool> accepted;
  std::string reason;  ///< empty: any
  std::string robot;   ///< of query or candidate; empty: any
};

/// When what a transaction has written survives also a loss of power; the end of the process it survives at once.
/// kWithNext: with the next one that does at once. Nobody waits for the disk then, and the store is whole in any case.
enum class Durable : uint8_t { kAtOnce, kWithNext };

/// All that is written until commit() becomes durable together, or nothing of it. Must not outlive its store.
class StoreTransaction {
 public:
  /// `hasty`: waits for the disk again from the end of this on; may be null.
  explicit StoreTransaction(std::unique_ptr<class Transaction> transaction, class Database* hasty = nullptr);
  StoreTransaction(StoreTransaction&&) noexcept;
  ~StoreTransaction();
  Result<void> commit();

 private:
  std::unique_ptr<class Transaction> transaction_;
  class Database* hasty_ = nullptr;
};

/// A row that is read whole is held against its checksum; one that does not fit is kBadData, by its name.
/// Thread rule: one thread at a time.
class MapStore {
 public:
  enum class Mode { kCreateOrOpen, kOpen, kReadOnly };
  /// kUnreachable if the file cannot be opened, or another program has it open to write and this one wants to, too;
  /// kBadData if it is no map store or of another schema version. Writing includes bringing it to this version.
  static Result<MapStore> open(const std::string& path, Mode mode);
  const std::string& path() const;  ///< absolute
  MapStore(MapStore&&) noexcept;
  MapStore& operator=(MapStore&&) noexcept;
  ~MapStore();

  Result<StoreTransaction> begin(Durable durable = Durable::kAtOnce);
  /// What is read until the end of it is of one moment, though a core writes meanwhile.
  Result<StoreTransaction> beginReading() const;

  /// Idempotent by id: true if it was new. `encoded` is the keyframe message as received.
  Result<bool> addKeyframe(const KeyframeId& id, int64_t stamp_ns, std::span<const uint8_t> encoded);
  Result<std::vector<StoredKeyframe>> keyframes() const;
  /// Those that have a pose, in order of arrival; the poses themselves are not looked at.
  Result<std::vector<KeyframeId>> mappedKeyframes() const;
  Result<std::vector<uint8_t>> encodedKeyframe(const KeyframeId& id) const;

  /// An edge of the same kind between the same keyframes, in this direction, is replaced in its place.
  Result<void> addEdge(const Edge& edge);
  /// Those that hold, in order of addition.
  Result<std::vector<Edge>> edges() const;
  Result<std::vector<WithdrawnEdge>> withdrawnEdges() const;
  struct EdgeCounts {
    std::array<size_t, kEdgeKinds> holding{};  ///< by kind
    size_t withdrawn = 0;
  };
  /// How many there are, without reading them.
  Result<EdgeCounts> edgeCounts() const;
  /// Those that hold and decide which maps are one: odometry, and closures of merges. Without poses and information.
  Result<std::vector<Edge>> shapingEdges() const;
  /// Withdraws, for `merge`, all but odometry that hold and of which `apart` is true; it hears only ends and kind.
  /// Returns the ends of those.
  Result<std::vector<std::pair<KeyframeId, KeyframeId>>> withdrawEdges(uint32_t merge,
                                                                       const std::function<bool(const Edge&)>& apart);
  /// Edges that went with `merge` hold again. Returns those that are closures of it, without poses and information.
  Result<std::vector<Edge>> restoreEdges(uint32_t merge);
  /// Takes out all of one kind, withdrawn ones too.
  Result<void> removeEdges(EdgeKind kind);
  /// Takes out closures of merges that are not in the store.
  Result<void> removeClosuresOfNone();
  /// The edge is kept, but holds no longer because `merge` was undone; 0: it holds again. kWrongUse if there is none.
  Result<void> withdrawEdge(const Edge& edge, uint32_t merge);
  Result<void> addVerdict(const MatchVerdict& verdict);
  /// In order of judgement; one at a time, where there are too many to be kept.
  Result<void> eachVerdict(const VerdictFilter& filter, const std::function<void(MatchVerdict&& verdict)>& take) const;
  Result<std::vector<MatchVerdict>> verdicts(const VerdictFilter& filter = {}) const;
  /// How many verdicts there are of each reason, "accepted" among them; of one robot if it is not empty.
  Result<std::map<std::string, size_t>> verdictCounts(const std::string& robot = "") const;
  /// A record of the same number is replaced.
  Result<void> addMerge(const MergeRecord& merge);
  /// Undone ones too, in order of their numbers.
  Result<std::vector<MergeRecord>> merges() const;
  /// Notes that `merge` was undone, together with `undone_by` (itself or another); an empty `reason`: it holds again.
  /// kWrongUse if there is none.
  Result<void> undoMerge(uint32_t merge, const std::string& reason, uint32_t undone_by);
  /// Numbers of the merges that were undone together with `merge`, itself included.
  Result<std::vector<uint32_t>> mergesUndoneBy(uint32_t merge) const;

  /// Replaces poses and map names of the given keyframes in one transaction; kWrongUse, and nothing
  /// changes, if one is not in the store.
  Result<void> setPoses(const MapId& map, const std::map<KeyframeId, Pose>& T_map_cam);
  /// Replaces all tiles of all maps in one transaction.
  Result<void> setTiles(std::span<const Tile> tiles);
  /// Tiles of one map, or of all if `map` is empty, sorted by key.
  Result<std::vector<Tile>> tiles(const MapId& map) const;
  /// Number of surfels and tiles per map, without reading the tiles.
  struct MapSize {
    size_t tiles = 0, surfels = 0;
  };
  Result<std::map<MapId, MapSize>> mapSizes() const;

  /// Robot names in order of first arrival: position = contributor bit.
  Result<std::vector<std::string>> robots() const;

  /// kWrongUse, with those that it knows, if the store knows no such robot.
  Result<void> checkRobot(const std::string& robot) const;
  /// Takes out all that came from `robot`: keyframes, edges and verdicts of theirs, and every merge that holds and that
  /// the robot was part of, with its closures; whether the others' maps belong together is then to be judged anew from
  /// their verdicts. Undone merges stay as long as closures of theirs do. Tiles of its maps go too. Returns the number
  /// of keyframes. kWrongUse if the store knows no such robot. What was deleted is overwritten with zeros; its room,
  /// and what earlier changes may have left there, goes with compact().
  Result<size_t> removeRobot(const std::string& robot);
  /// Whether a robot was removed since the file was last written anew.
  Result<bool> compactDue() const;
  /// Writes the file anew without what was deleted. Interrupted, it is still due.
  Result<void> compact();

  /// How many keyframes were mapped when a merge that had been undone was given again; nothing if it never was.
  Result<std::optional<size_t>> givenAgain(uint32_t merge) const;
  Result<void> setGivenAgain(uint32_t merge, size_t keyframes);

  /// Whether the store takes changes now: so many bytes are written and taken back. The error says why it does not.
  Result<void> tryWriting(size_t bytes);

  /// Whether a robot is with the core, or has ended orderly; by robot, of those that this was ever noted of.
  Result<std::map<std::string, bool>> presences() const;
  Result<void> setPresent(const std::string& robot, bool present);

  /// Counts one more start of a core that continues this store: 1 for the first of them.
  Result<uint32_t> countStart();

  /// Whether accepted matches are to be judged anew, because what they were judged by has been taken out.
  Result<bool> votesWait() const;
  Result<void> setVotesWait(bool wait);

  Result<void> setMeta(const std::string& key, const std::string& value);
  Result<std::string> meta(const std::string& key) const;  ///< empty if unset

 private:
  struct State;
  explicit MapStore(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace comap
