#include "edge_agent/uplink/keyframe_sender.h"

#include <algorithm>
#include <set>

#include "edge_agent/uplink/make_room.h"

namespace comap {
namespace {

constexpr uint64_t kSpareBytes = 64'000'000;
constexpr std::chrono::milliseconds kRetryAfter{100};
constexpr std::chrono::seconds kDiskAgain{5};
constexpr size_t kRefusedTold = 2;  // a status has to fit one datagram

}  // namespace

KeyframeSender::KeyframeSender(Link& link, const std::string& robot, uint64_t session, const SenderOptions& options,
                               Outbox outbox, Log log)
    : link_(link),
      robot_(robot),
      session_(session),
      options_(options),
      log_(std::move(log)),
      outbox_(std::move(outbox)),
      window_(options.send),
      loss_log_(log_) {}

// How many sequences before `sequence` are nowhere: neither here nor, as far as is known, at the core.
uint32_t KeyframeSender::missingBefore(uint32_t sequence) {
  uint32_t known = acknowledged_below_;
  for (Outbox* box : {&outbox_, spare_ ? &*spare_ : nullptr}) {
    if (box == nullptr || box->size(session_) == 0) continue;
    const auto last = box->last(session_);
    if (last && *last) known = std::max(known, (*last)->key.sequence + 1);
  }
  return sequence - std::min(known, sequence);
}

Result<void> KeyframeSender::add(const Keyframe& keyframe) {
  Keyframe joined;  // a copy only where a link has to change
  const Keyframe* shipped = &keyframe;
  const auto gone = keyframe.linked ? dropped_.find(keyframe.linked_to) : dropped_.end();
  const uint32_t skipped = broken_ ? missingBefore(keyframe.id.sequence) : 0;
  if (gone != dropped_.end() || skipped > 0) {
    joined = keyframe;
    joined.skipped = skipped;
    KeyframeLink link{keyframe.linked, keyframe.linked_to, keyframe.T_link_this, keyframe.information};
    for (auto step = gone; link.linked && step != dropped_.end(); step = dropped_.find(link.linked_to))
      link = joinLinks(step->second, link);
    joined.linked = link.linked;
    joined.linked_to = link.linked_to;
    joined.T_link_this = link.T_link_this;
    joined.information = link.information;
    shipped = &joined;
  }
  const auto encoded = encodeKeyframe(*shipped, options_.jpeg_quality);
  if (!encoded) return encoded.error();
  OutboxRow row;
  row.key = {keyframe.id.session, keyframe.id.sequence};
  row.T_odom_cam = shipped->T_odom_cam;
  row.link = {shipped->linked, shipped->linked_to, shipped->T_link_this, shipped->information};
  row.skipped = shipped->skipped;
  if (auto stored = store(row, *encoded); !stored) {
    if (stored.error().code == ErrorCode::kWrongUse) return stored;
    // Dropped before anything hangs on it.
    dropped_[row.key.sequence] = row.link;
    broken_ = true;
    ++losses_.dropped;
    tellLosses(std::chrono::steady_clock::now());
    return {};
  }
  broken_ = false;
  keepWithinQuota();
  return {};
}

// Into the outbox; into memory while that fails, and until memory is empty again, so that neither holds a keyframe
// that another one in the other hangs on.
Result<void> KeyframeSender::store(const OutboxRow& row, std::span<const uint8_t> encoded) {
  if (spare_ && spare_->size() == 0) spare_.reset();
  if (!spare_) {
    auto added = outbox_.add(row, encoded);
    if (!added && added.error().code == ErrorCode::kBadData) {
      failed(added.error());
      added = outbox_.add(row, encoded);
    }
    if (added) {
      diskTakes();
      return {};
    }
    if (added.error().code == ErrorCode::kWrongUse) return added;
    failed(added.error());
    auto spare = Outbox::inMemory();
    if (!spare) return spare.error();
    spare_.emplace(std::move(*spare));
  }
  return spare_->add(row, encoded);
}

// Damage: what is whole goes on in a new file. Anything else passes by itself or is for people to mend.
void KeyframeSender::failed(const Error& error) {
  if (error.code == ErrorCode::kBadData && outbox_.path() != ":memory:") {
    const std::string path = outbox_.path();
    log_("outbox: " + error.text);
    auto nowhere = Outbox::inMemory();
    if (!nowhere) return;
    const size_t before = outbox_.size();
    const std::set<OutboxKey> delivered = outbox_.deliveredButThere();
    outbox_ = std::move(*nowhere);  // lets go of the damaged file
    auto rescued = rescueOutbox(path);
    log_(rescued ? rescued->told : "outbox: " + rescued.error().text);
    if (!rescued) return;
    outbox_ = std::move(rescued->outbox);
    if (auto known = outbox_.knowDelivered(delivered); !known) log_("outbox: " + known.error().text);
    losses_.damaged += static_cast<uint32_t>(before - std::min(before, outbox_.size()));
    for (const OutboxRow& row : rescued->lost)
      if (row.key.session == session_) dropped_[row.key.sequence] = row.link;
    broken_ = true;
    return;
  }
  if (!failing_)
    log_("outbox cannot be written: " + error.text +
         "; what it holds is sent all the same; new keyframes are kept in memory, 64 MB of them, until it can, and are "
         "lost if this agent ends before: make room, or name another outbox.directory");
  failing_ = true;
}

void KeyframeSender::diskTakes() {
  if (failing_) log_("outbox " + outbox_.path() + " can be written again");
  failing_ = false;
}

Result<void> KeyframeSender::moveOldestToDisk() {
  const auto row = spare_->firstFrom(session_, 0);
  if (!row) return row.error();
  if (!*row) return {};
  const auto encoded = spare_->encoded((*row)->key);
  if (!encoded) return encoded.error();
  if (auto added = outbox_.add(**row, *encoded); !added) return added;
  return spare_->remove((*row)->key);
}

void KeyframeSender::takeOutDelivered() {
  if (const auto taken = outbox_.takeOutDelivered(); !taken) failed(taken.error());
}

void KeyframeSender::tryDisk(std::chrono::steady_clock::time_point now) {
  if (!failing_ || now < disk_) return;
  takeOutDelivered();
  disk_ = now + kDiskAgain;
  if (waitingInMemory() == 0) return;
  const auto moved = moveOldestToDisk();
  if (!moved) return failed(moved.error());
  disk_ = now;
  if (waitingInMemory() == 0) diskTakes();
}

void KeyframeSender::saveToDisk() {
  loss_log_.tell();  // before whoever calls this tells what is left
  takeOutDelivered();
  if (waitingInMemory() == 0) return;
  while (waitingInMemory() > 0)
    if (auto moved = moveOldestToDisk(); !moved) return failed(moved.error());
  diskTakes();
}

void KeyframeSender::keepWithinQuota() {
  Outbox& box = spare_ ? *spare_ : outbox_;
  if (!box.deliveredButThere().empty()) return;  // the disk takes nothing
  const uint64_t quota = spare_ ? std::min(kSpareBytes, options_.outbox_quota_bytes) : options_.outbox_quota_bytes;
  if (box.bytes() <= quota) return;
  auto made = makeRoom(box, quota, options_.thin_jpeg_quality, cursor_);
  if (!made) return failed(made.error());
  losses_.thinned += made->thinned;
  losses_.dropped += static_cast<uint32_t>(made->dropped.size());
  for (const OutboxRow& row : made->dropped)
    if (row.key.session == session_) dropped_[row.key.sequence] = row.link;
  tellLosses(std::chrono::steady_clock::now());
}

Outbox& KeyframeSender::boxOf(const OutboxKey& key) {
  if (!spare_) return outbox_;
  const auto held = spare_->rows(key.session, key.sequence, 1);
  return held && !held->empty() && held->front().key == key ? *spare_ : outbox_;
}

std::optional<OutboxKey> KeyframeSender::nextUnsent() {
  std::vector<uint64_t> sessions = outbox_.sessions();
  if (spare_ && spare_->size() > 0 && (sessions.empty() || sessions.back() != session_)) sessions.push_back(session_);
  for (auto session = sessions.rbegin(); session != sessions.rend(); ++session) {
    for (Outbox* box : {&outbox_, spare_ ? &*spare_ : nullptr}) {
      if (box == nullptr || box->size(*session) == 0) continue;
      const auto row = box->firstFrom(*session, next_[*session]);
      if (!row) {
        failed(row.error());
        return std::nullopt;
      }
      if (*row) return (*row)->key;
    }
  }
  return std::nullopt;
}

bool KeyframeSender::send(const OutboxKey& key, std::chrono::steady_clock::time_point now) {
  Outbox& box = boxOf(key);
  const auto bytes = box.encoded(key);
  if (!bytes) {
    window_.forget(key);
    refused_.forget(key);
    if (bytes.error().code != ErrorCode::kProblem) failed(bytes.error());
    return false;
  }
  // Before it is sent: from then on the core may hold it.
  if (auto marked = box.markSent(key); !marked) failed(marked.error());
  if (!link_.publish(Topic::kKeyframe, robot_, *bytes)) {
    retry_ = now + kRetryAfter;
    return false;
  }
  bytes_sent_ += bytes->size();
  window_.sent(key, bytes->size(), now);
  refused_.sent(key, *bytes);
  return true;
}

void KeyframeSender::sendDue(std::chrono::steady_clock::time_point now) {
  if (now < retry_ || waitingInAll() == 0) return;
  const bool peer = link_.peers() > 0;
  if (peer && !had_peer_) {
    window_.restart();
    refused_.tryAgain();
  }
  had_peer_ = peer;
  if (!peer) return;
  // While the link still carries what it has, a repeat would only wait behind it.
  if (link_.delivered(Topic::kKeyframe, robot_)) {
    for (const OutboxKey& key : window_.overdue(now))
      if (!send(key, now)) return;
  }
  while (window_.hasRoom(now)) {
    const auto key = nextUnsent();
    if (!key) break;
    if (!send(*key, now)) return;
    next_[key->session] = key->sequence + 1;
  }
  const auto again = refused_.due(now);
  if (again && window_.hasRoom(now)) send(*again, now);
}

void KeyframeSender::refuse(uint32_t checksum, const std::string& reason, std::chrono::steady_clock::time_point now) {
  const bool told = refused_.reason() == reason;
  const auto key = refused_.refuse(checksum, reason, now);
  if (!key) return;
  window_.forget(*key);
  if (told) return;
  log_("the core refuses keyframe " + toString(KeyframeId{robot_, key->session, key->sequence}) + ": " + reason +
       ". It stays in the outbox and is sent again now and then, as are others that are refused so");
}

std::vector<RefusedKeyframe> KeyframeSender::refusedToTell() {
  std::vector<RefusedKeyframe> told;
  for (const OutboxKey& key : refused_.nextToTell(kRefusedTold)) {
    const auto row = boxOf(key).firstFrom(key.session, key.sequence);
    if (row && *row && (*row)->key == key) told.push_back({key.session, key.sequence, (*row)->link});
  }
  return told;
}

void KeyframeSender::acknowledge(const Acknowledgement& acknowledgement, std::chrono::steady_clock::time_point now) {
  if (acknowledgement.robot != robot_ || !acknowledgement.refusal.empty()) return;
  if (!acknowledgement.refused.empty()) refuse(acknowledgement.refused_checksum, acknowledgement.refused, now);
  if (acknowledgement.session == session_)
    acknowledged_below_ = std::max(acknowledged_below_, acknowledgement.next_expected);
  for (Outbox* box : {&outbox_, spare_ ? &*spare_ : nullptr}) {
    if (box == nullptr) continue;
    const auto held = box->acknowledge(acknowledgement);
    if (held) {
      window_.acknowledged(*held, now);
      for (const OutboxKey& key : *held) refused_.forget(key);
    } else {
      failed(held.error());
    }
  }
  if (spare_) (void)bool(spare_->takeOutDelivered());  // memory takes it
  takeOutDelivered();
}

size_t KeyframeSender::sizeOf(uint64_t session) const {
  return outbox_.size(session) + (spare_ ? spare_->size(session) : 0);
}

size_t KeyframeSender::waitingInAll() const { return outbox_.size() + waitingInMemory(); }

uint64_t KeyframeSender::waitingBytes() const { return outbox_.bytes() + (spare_ ? spare_->bytes() : 0); }

}  // namespace comap
