#include "edge_agent/uplink/outbox.h"

#include <algorithm>
#include <tuple>

#include "edge_agent/uplink/outbox_rows.h"
#include "protocol/codec/message_checksum.h"

namespace comap {
namespace {

constexpr int64_t kBytesBeside = 1024;  // a row's share of the file besides its message

int64_t signedOf(uint64_t session) { return static_cast<int64_t>(session); }

std::span<const uint8_t> bytesOf(const Matrix6d& matrix) {
  return {reinterpret_cast<const uint8_t*>(matrix.data()), sizeof(double) * 36};
}

Result<std::vector<OutboxRow>> rowsOf(Query& query) {
  std::vector<OutboxRow> rows;
  for (;;) {
    const auto row = query.step();
    if (!row) return row.error();
    if (!*row) return rows;
    rows.push_back(rowOf(query));
  }
}

Query& bind(Query& query, const OutboxKey& key) {
  return query.bind(signedOf(key.session)).bind(int64_t{key.sequence});
}

}  // namespace

Result<void> Outbox::countAll() {
  auto query = database_.query("SELECT session, count(*), sum(bytes) FROM keyframes GROUP BY session");
  if (!query) return query.error();
  keyframes_.clear();
  bytes_ = 0;
  for (;;) {
    const auto row = query->step();
    if (!row) return row.error();
    if (!*row) return {};
    const auto session = static_cast<uint64_t>(query->integer());
    const auto keyframes = query->integer();
    const auto bytes = query->integer();
    keyframes_[session] = static_cast<size_t>(keyframes);
    bytes_ += static_cast<uint64_t>(bytes + keyframes * kBytesBeside);
  }
}

Result<Outbox::Change> Outbox::begin() {
  auto transaction = Transaction::begin(database_);
  if (!transaction) return transaction.error();
  return Change(*this, std::move(*transaction));
}

Outbox::Change::Change(Outbox& outbox, Transaction transaction)
    : outbox_(outbox), transaction_(std::move(transaction)), before_({outbox.keyframes_, outbox.bytes_}) {}

Outbox::Change::~Change() {
  if (before_) std::tie(outbox_.keyframes_, outbox_.bytes_) = *before_;
}

Result<void> Outbox::Change::commit() {
  auto committed = transaction_.commit();
  if (committed) before_.reset();
  return committed;
}

void Outbox::count(uint64_t session, int keyframes, int64_t bytes) {
  auto& held = keyframes_[session];
  held += static_cast<size_t>(keyframes);
  if (held == 0) keyframes_.erase(session);
  bytes_ += static_cast<uint64_t>(bytes + keyframes * kBytesBeside);
}

Result<void> Outbox::add(const OutboxRow& row, std::span<const uint8_t> encoded) {
  auto change = begin();
  if (!change) return change.error();
  auto known = database_.query("INSERT INTO keyframes (" COMAP_OUTBOX_ROW_COLUMNS
                               ", crc32) VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?)");
  if (!known) return known.error();
  bind(*known, row.key).bind(static_cast<int64_t>(encoded.size())).bind(int64_t{row.sent}).bind(int64_t{row.thinned});
  known->bind(int64_t{row.skipped}).bind(int64_t{row.link.linked}).bind(int64_t{row.link.linked_to});
  known->bind(row.T_odom_cam).bind(row.link.T_link_this).bind(bytesOf(row.link.information));
  if (auto ran = known->bind(int64_t{messageChecksum(encoded)}).run(); !ran) return ran;
  auto message = database_.query("INSERT INTO messages (session, sequence, encoded) VALUES (?, ?, ?)");
  if (!message) return message.error();
  if (auto ran = bind(*message, row.key).bind(encoded).run(); !ran) return ran;
  count(row.key.session, 1, static_cast<int64_t>(encoded.size()));
  return change->commit();
}

Result<std::vector<uint8_t>> Outbox::encoded(const OutboxKey& key) {
  auto query = database_.query(
      "SELECT crc32, encoded FROM messages JOIN keyframes USING (session, sequence) WHERE session = ? AND sequence = "
      "?");
  if (!query) return query.error();
  const auto row = bind(*query, key).step();
  if (!row) return row.error();
  const std::string name = path() + ": keyframe " + std::to_string(key.session) + "/" + std::to_string(key.sequence);
  if (!*row) return Error{ErrorCode::kProblem, name + " is not there"};
  const uint32_t expected = query->unsigned32();
  const auto bytes = query->bytes();
  if (messageChecksum(bytes) != expected) return Error{ErrorCode::kBadData, name + " is damaged"};
  return std::vector<uint8_t>(bytes.begin(), bytes.end());
}

Result<std::optional<OutboxRow>> Outbox::firstFrom(uint64_t session, uint32_t from) {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE session = ? AND sequence >= ? ORDER BY sequence");
  if (!query) return query.error();
  bind(*query, {session, from});
  for (;;) {
    const auto row = query->step();
    if (!row) return row.error();
    if (!*row) return std::optional<OutboxRow>();
    OutboxRow found = rowOf(*query);
    if (auto values = query->values(); !values) return values.error();
    if (!delivered_.contains(found.key)) return std::optional(std::move(found));
  }
}

Result<std::vector<OutboxRow>> Outbox::rows(uint64_t session, uint32_t from, size_t most) {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE session = ? AND sequence >= ? ORDER BY sequence LIMIT ?");
  if (!query) return query.error();
  bind(*query, {session, from}).bind(static_cast<int64_t>(most));
  return rowsOf(*query);
}

Result<std::optional<OutboxRow>> Outbox::last(uint64_t session) {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE session = ? ORDER BY sequence DESC LIMIT 1");
  if (!query) return query.error();
  const auto found = rowsOf(query->bind(signedOf(session)));
  if (!found) return found.error();
  return found->empty() ? std::optional<OutboxRow>() : std::optional(found->front());
}

Result<std::vector<OutboxRow>> Outbox::linkedTo(const OutboxKey& key) {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE session = ? AND linked_to = ? AND linked = 1 ORDER BY sequence");
  if (!query) return query.error();
  return rowsOf(bind(*query, key));
}

Result<std::optional<OutboxRow>> Outbox::oldestUnthinned() {
  auto query = database_.query("SELECT " COMAP_OUTBOX_ROW_COLUMNS
                               " FROM keyframes WHERE thinned = 0 AND sent = 0 ORDER BY session, sequence LIMIT 1");
  if (!query) return query.error();
  const auto row = query->step();
  if (!row) return row.error();
  return *row ? std::optional(rowOf(*query)) : std::optional<OutboxRow>();
}

Result<void> Outbox::markSent(const OutboxKey& key) {
  auto query = database_.query("UPDATE keyframes SET sent = 1 WHERE session = ? AND sequence = ? AND sent = 0");
  if (!query) return query.error();
  return bind(*query, key).run();
}

Result<void> Outbox::replace(const OutboxRow& row, std::span<const uint8_t> encoded) {
  auto change = begin();
  if (!change) return change.error();
  if (auto removed = remove(row.key); !removed) return removed;
  if (auto added = add(row, encoded); !added) return added;
  return change->commit();
}

Result<void> Outbox::remove(const OutboxKey& key) {
  auto change = begin();
  if (!change) return change.error();
  auto size = database_.query("SELECT bytes FROM keyframes WHERE session = ? AND sequence = ?");
  if (!size) return size.error();
  const auto there = bind(*size, key).step();
  if (!there) return there.error();
  if (!*there) return {};
  const int64_t bytes = size->integer();
  if (auto erased = erase(key); !erased) return erased;
  count(key.session, -1, -bytes);
  return change->commit();
}

Result<void> Outbox::erase(const OutboxKey& key) {
  for (const char* sql : {"DELETE FROM keyframes WHERE session = ? AND sequence = ?",
                          "DELETE FROM messages WHERE session = ? AND sequence = ?"}) {
    auto query = database_.query(sql);
    if (!query) return query.error();
    if (auto ran = bind(*query, key).run(); !ran) return ran;
  }
  return {};
}

void Outbox::deliver(const OutboxKey& key, int64_t bytes) {
  if (delivered_.insert(key).second) count(key.session, -1, -bytes);
}

Result<void> Outbox::deliverIfThere(const OutboxKey& key) {
  auto query = database_.query("SELECT bytes FROM keyframes WHERE session = ? AND sequence = ?");
  if (!query) return query.error();
  const auto there = bind(*query, key).step();
  if (!there) return there.error();
  if (*there) deliver(key, query->integer());
  return {};
}

Result<std::vector<OutboxKey>> Outbox::acknowledge(const Acknowledgement& acknowledgement) {
  std::vector<OutboxKey> held;
  if (size(acknowledgement.session) == 0 || !acknowledgement.refusal.empty()) return held;
  auto below = database_.query("SELECT sequence, bytes FROM keyframes WHERE session = ? AND sequence < ?");
  if (!below) return below.error();
  bind(*below, {acknowledgement.session, acknowledgement.next_expected});
  for (;;) {
    const auto row = below->step();
    if (!row) return row.error();
    if (!*row) break;
    held.push_back({acknowledgement.session, below->unsigned32()});
    deliver(held.back(), below->integer());
  }
  for (const uint32_t sequence : acknowledgement.also_held) {
    held.push_back({acknowledgement.session, sequence});
    if (auto delivered = deliverIfThere(held.back()); !delivered) return delivered.error();
  }
  return held;
}

Result<void> Outbox::knowDelivered(const std::set<OutboxKey>& keys) {
  for (const OutboxKey& key : keys)
    if (auto delivered = deliverIfThere(key); !delivered) return delivered;
  return {};
}

Result<void> Outbox::takeOutDelivered() {
  if (delivered_.empty()) return {};
  auto change = begin();
  if (!change) return change.error();
  for (const OutboxKey& key : delivered_)
    if (auto erased = erase(key); !erased) return erased;
  if (auto committed = change->commit(); !committed) return committed;
  delivered_.clear();
  // Once all is delivered the file gives its room back; if it cannot now, then the next time.
  return bytes_ > 0 ? Result<void>() : database_.execute("PRAGMA incremental_vacuum");
}

Result<void> Outbox::limitBytes(uint64_t bytes) {
  const auto page = database_.integer("PRAGMA page_size");
  if (!page) return page.error();
  const std::string sql = "PRAGMA max_page_count = " + std::to_string(bytes / static_cast<uint64_t>(*page));
  return database_.execute(sql.c_str());
}

size_t Outbox::size() const {
  size_t all = 0;
  for (const auto& [session, keyframes] : keyframes_) all += keyframes;
  return all;
}

size_t Outbox::size(uint64_t session) const {
  const auto found = keyframes_.find(session);
  return found == keyframes_.end() ? 0 : found->second;
}

std::vector<uint64_t> Outbox::sessions() const {
  std::vector<uint64_t> sessions;
  for (const auto& [session, keyframes] : keyframes_) sessions.push_back(session);
  return sessions;
}

}  // namespace comap
