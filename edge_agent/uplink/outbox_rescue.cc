// What can be saved of a damaged outbox.
#include <algorithm>
#include <filesystem>

#include "edge_agent/uplink/lent_first_page.h"
#include "edge_agent/uplink/make_room.h"
#include "edge_agent/uplink/outbox.h"
#include "edge_agent/uplink/outbox_wreck.h"
#include "protocol/codec/limits.h"
#include "protocol/types/counted.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

// From the wreck into a new outbox, in order.
struct Salvage {
  OutboxWreck& from;
  RescuedOutbox& rescued;
  size_t saved = 0;
  std::map<OutboxKey, KeyframeLink> lost_links = {};
  uint64_t session = 0;
  uint32_t next = 0;     // sequence after the last one saved of this session
  bool missing = false;  // some between that and the next one may be gone

  Result<void> take(const OutboxKey& key, const OutboxWreck::Keyframe& known) {
    if (key.session != session) {
      session = key.session;
      next = 0;
      missing = from.holes();
    }
    auto message = from.messageOf(key);
    OutboxRow row = known.row.value_or(OutboxRow{key, 0, true, true, {}, {}, 0});
    if (const auto told = message ? decodeKeyframeWithoutImages(*message) : Error{}; told) {
      row.T_odom_cam = told->T_odom_cam;
      row.link = {told->linked, told->linked_to, told->T_link_this, told->information};
      row.skipped = told->skipped;
    }
    const auto gone = lost_links.find({session, row.link.linked_to});
    const bool hung = row.link.linked && gone != lost_links.end();
    if (hung) row.link = joinLinks(gone->second, row.link);
    if (!message) return lose(row, known);
    // What is gone must be told, or the core waits for it; of what it holds already it takes no notice.
    const uint32_t gap = std::min(key.sequence - std::min(next, key.sequence), kMaxSkipped);
    if (missing && gap > row.skipped) row.skipped = gap;
    if (hung || missing)
      if (auto relinked = relinkKeyframe(*message, row.link, row.skipped)) message = std::move(*relinked);
    const auto added = rescued.outbox.add(row, *message);
    if (!added && added.error().code == ErrorCode::kWrongUse) return lose(row, known);  // its own words cannot be
    if (!added) return added;
    ++saved;
    next = key.sequence + 1;
    missing = from.holes();
    return {};
  }

  Result<void> lose(const OutboxRow& row, const OutboxWreck::Keyframe& known) {
    missing = true;
    if (!known.row) return {};
    lost_links[row.key] = row.link;
    rescued.lost.push_back(row);
    return {};
  }
};

Result<std::string> putAside(const std::string& path) {
  std::string aside;
  for (int i = 1; aside.empty() || fs::exists(aside); ++i) aside = path + ".damaged-" + std::to_string(i);
  for (const std::string part : {"", "-wal"}) {
    std::error_code code;
    fs::rename(path + part, aside + part, code);
    if (code && part.empty())
      return Error{ErrorCode::kUnreachable,
                   path + ": is damaged and cannot be put aside as " + aside + ": " + code.message()};
  }
  return aside;
}

// All at once; nothing of it if the disk is full, say.
Result<size_t> saveAll(OutboxWreck& wreck, RescuedOutbox& rescued) {
  auto change = rescued.outbox.begin();
  if (!change) return change.error();
  Salvage salvage{wreck, rescued};
  for (const auto& [key, known] : wreck.keyframes())
    if (auto taken = salvage.take(key, known); !taken) return taken.error();
  if (auto committed = change->commit(); !committed) return committed.error();
  return salvage.saved;
}

Result<RescuedOutbox> saveInto(const std::string& path, const std::string& aside) {
  auto fresh = Outbox::open(path);
  if (!fresh) return fresh.error();
  RescuedOutbox rescued{std::move(*fresh), {}, {}, true};
  rescued.told = "outbox " + path + " was damaged: it was put aside as " + aside + "; ";
  std::unique_ptr<LentFirstPage> lent;
  // Of one without a byte SQLite would take the log away.
  std::error_code none;
  auto wreck = fs::file_size(aside, none) == 0 ? Result<OutboxWreck>(Error()) : OutboxWreck::survey(aside);
  if (!wreck && (lent = LentFirstPage::lend(aside))) wreck = OutboxWreck::survey(aside);
  if (!wreck) {
    rescued.told += "nothing of it could be read";
    return rescued;
  }
  // Of the new file, so that no number comes again.
  if (auto begun = rescued.outbox.beginSession(wreck->lastSession()); !begun) return begun.error();
  const auto saved = saveAll(*wreck, rescued);
  if (!saved) return saved.error();
  rescued.holes = wreck->holes();
  rescued.told += counted(*saved, "keyframe") + " of it could be saved, " + std::to_string(rescued.lost.size()) +
                  " not" + (wreck->holes() ? ", and places in it could not be read" : "");
  return rescued;
}

}  // namespace

Result<RescuedOutbox> rescueOutbox(const std::string& path) {
  const auto aside = putAside(path);
  if (!aside) return aside.error();
  auto rescued = saveInto(path, *aside);
  if (rescued) return rescued;
  // Another start shall try again.
  std::error_code ignored;
  for (const std::string part : {"", "-wal"}) {
    fs::remove(path + part, ignored);
    fs::rename(*aside + part, path + part, ignored);
  }
  return Error{ErrorCode::kUnreachable,
               path + ": is damaged, and what it holds could not be written anew: " + rescued.error().text};
}

}  // namespace comap
