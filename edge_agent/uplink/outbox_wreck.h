// What a damaged outbox still holds. Inside the outbox only.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "edge_agent/uplink/outbox.h"
#include "protocol/storage/database.h"
#include "protocol/storage/leaf_rows.h"
#include "protocol/types/result.h"

namespace comap {

/// A keyframe is told twice: in its row, with a checksum of its message, and in its message. Either may be gone.
class OutboxWreck {
 public:
  struct Keyframe {
    std::optional<OutboxRow> row;
    uint32_t checksum = 0;           ///< of its message, as the row tells
    std::optional<int64_t> message;  ///< number of its message's row
    std::vector<LeafRow> leaves;     ///< what may be its message, where nothing leads to that
  };

  /// Looks at every row that SQLite can reach, on behind those it cannot, and for messages that are left out then at
  /// every page by itself. kBadData if the list of tables cannot be read.
  static Result<OutboxWreck> survey(const std::string& path);

  const std::map<OutboxKey, Keyframe>& keyframes() const { return keyframes_; }
  /// Whether places could not be read: keyframes may be gone of which nothing is known.
  bool holes() const { return holes_; }
  /// The last session number given, as far as that is known.
  uint64_t lastSession() const { return last_session_; }

  /// The message, if it is what was written: by its checksum, or, where no row tells that, because it is a whole
  /// keyframe of this key.
  std::optional<std::vector<uint8_t>> messageOf(const OutboxKey& key);

 private:
  explicit OutboxWreck(Database database) : database_(std::move(database)) {}
  void surveyMessages();
  void surveyRows();
  void surveyLeaves();
  std::optional<std::vector<uint8_t>> storedMessage(int64_t number);
  void takeRow(Query& query);
  int64_t sessionBehind(int64_t session) const;

  Database database_;
  std::map<OutboxKey, Keyframe> keyframes_;
  uint64_t last_session_ = 0;
  std::optional<LeafRows> leaves_;
  bool holes_ = false, rows_have_holes_ = false;
};

}  // namespace comap
