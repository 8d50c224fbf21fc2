// What can be saved of a damaged outbox.
#include <filesystem>

#include "edge_agent/uplink/make_room.h"
#include "edge_agent/uplink/outbox.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

struct Salvage {
  Outbox& to;
  std::map<OutboxKey, KeyframeLink> lost_links;
  uint32_t missing = 0;  // right before the next row of this session
  uint64_t session = 0;

  // True if it was whole and is in the new outbox.
  bool take(Outbox& from, OutboxRow row) {
    if (row.key.session != session) missing = 0;
    session = row.key.session;
    auto encoded = from.encoded(row.key);
    auto gone = lost_links.find({session, row.link.linked_to});
    const bool hung = row.link.linked && gone != lost_links.end();
    if (hung) row.link = joinLinks(gone->second, row.link);
    if (!encoded) {
      lost_links[row.key] = row.link;
      missing += 1 + row.skipped;
      return false;
    }
    if (hung || missing > 0) {
      row.skipped += missing;
      auto relinked = relinkKeyframe(*encoded, row.link, row.skipped);
      if (!relinked) return false;
      encoded = std::move(relinked);
    }
    missing = 0;
    return bool(to.add(row, *encoded));
  }
};

}  // namespace

Result<RescuedOutbox> rescueOutbox(const std::string& path) {
  std::string aside;
  for (int i = 1; aside.empty() || fs::exists(aside); ++i) aside = path + ".damaged-" + std::to_string(i);
  for (const std::string part : {"", "-wal"}) {
    std::error_code code;
    fs::rename(path + part, aside + part, code);
    if (code && part.empty())
      return Error{ErrorCode::kUnreachable,
                   path + ": is damaged and cannot be put aside as " + aside + ": " + code.message()};
  }
  auto fresh = Outbox::open(path);
  if (!fresh) return fresh.error();
  RescuedOutbox rescued{std::move(*fresh), {}, {}, false};
  size_t saved = 0;
  auto damaged = Outbox::open(aside);
  rescued.cut_off = !damaged;
  if (damaged) {
    // Of the new file, so that no number comes again.
    if (auto last = damaged->lastSession(); last)
      if (auto begun = rescued.outbox.beginSession(*last); !begun) return begun.error();
    Salvage salvage{rescued.outbox, {}, 0, 0};
    OutboxKey at;
    for (bool first = true;; first = false) {
      const auto row = first ? damaged->first() : damaged->after(at);
      rescued.cut_off = !row;
      if (!row || !*row) break;
      at = (*row)->key;
      if (salvage.take(*damaged, **row)) {
        ++saved;
      } else {
        rescued.lost.push_back(**row);
        rescued.lost.back().link = salvage.lost_links[at];
      }
    }
  }
  rescued.told = "outbox " + path + " was damaged: it was put aside as " + aside + "; " + std::to_string(saved) +
                 " keyframes of it could be saved, " + std::to_string(rescued.lost.size()) + " not" +
                 (rescued.cut_off ? ", and behind them nothing could be read" : "");
  return rescued;
}

}  // namespace comap
