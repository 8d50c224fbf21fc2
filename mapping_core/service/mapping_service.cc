#include "mapping_core/service/mapping_service.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "mapping_core/ferns/fern_book.h"
#include "mapping_core/service/map_finish.h"
#include "protocol/codec/codec.h"
#include "protocol/telemetry/stage_clock.h"

namespace comap {
namespace {

constexpr std::chrono::milliseconds kCalm(50);  // without a message; then what was put off is done
constexpr std::chrono::milliseconds kSoon(20);  // until more tiles may go
constexpr std::chrono::seconds kIdle(2);        // without a keyframe; or the load is small
constexpr size_t kFusedAtOnce = 4;              // keyframes whose surfels are missing, between looking for messages

std::string describe(const Confirmation& heard) {
  return fmt::format("confirmed by {} later keyframes and {} closures, {:.2f} % of the common surface contradicts it",
                     heard.witnesses, heard.supporters, 100 * heard.contradicted);
}

using Json = nlohmann::json;

}  // namespace

MappingService::MappingService(const ServiceOptions& options, Link& link, MapStore& store, gpu::Device& device, Log log)
    : options_(options),
      link_(link),
      store_(store),
      device_(device),
      log_(std::move(log)),
      store_health_(store, log_),
      presence_(store, store_health_),
      ingest_(store),
      registry_(FernBook::standard(options.mapping.fern_seed).hash()),
      builder_(device, store, options.mapping),
      tiles_({options.mapping.fusion.stable_confidence, options.tile_spacing_m}),
      delivery_(link, options.pace_tiles) {}

Result<void> MappingService::resume() {
  constexpr int kStartBits = 32;  // revisions of one life of the core
  if (auto read = presence_.resume(); !read) return read;
  const auto keyframes = store_.keyframes();
  if (!keyframes) return keyframes.error();
  if (keyframes->empty()) return {};
  const auto starts = store_.countStart();
  if (!starts) return starts.error();
  first_revision_ = uint64_t{*starts} << kStartBits;
  delivery_.beginAbove(first_revision_);
  if (auto stored = store_.setMeta("complete", "no"); !stored) return stored;
  const auto robots = store_.robots();
  if (!robots) return robots.error();
  for (const std::string& robot : *robots) robot_index_.emplace(robot, static_cast<uint32_t>(robot_index_.size()));
  const auto never = ingest_.resume(*keyframes);
  if (!never) return never.error();
  for (const KeyframeId& keyframe : *never) registry_.remember(keyframe);
  for (const StoredKeyframe& keyframe : *keyframes) registry_.remember(keyframe.id);
  for (const StoredKeyframe& keyframe : *keyframes) {
    if (keyframe.map.empty()) continue;
    ++keyframes_;
    registry_.markMapped(keyframe.id);
    auto& latest = latest_.try_emplace(keyframe.id.robot, Latest{keyframe.id, {}}).first->second.id;
    latest = std::max(latest, keyframe.id);
  }
  for (auto& [robot, latest] : latest_) {
    const auto encoded = store_.encodedKeyframe(latest.id);
    if (!encoded) return encoded.error();
    const auto keyframe = decodeKeyframeWithoutImages(*encoded);
    if (!keyframe) return keyframe.error();
    latest.T_odom_cam = keyframe->T_odom_cam;
  }
  if (auto restored = builder_.restore(); !restored) return restored;
  for (const KeyframeId& anchor : builder_.components().anchors()) unpublished_[anchor] = 1;
  info("continues with " + std::to_string(keyframes_) + " keyframes in " +
       std::to_string(builder_.components().anchors().size()) + " maps, " + std::to_string(ingest_.waiting()) +
       " more are still to be mapped");
  return {};
}

Result<bool> MappingService::step(std::chrono::milliseconds timeout) {
  bool worked = false;
  // What is mapped must be written as a whole; half of it cannot be taken back. So it waits until the store takes.
  const bool takes = store_health_.takes();
  const bool busy = (ingest_.hasNext() && takes) || !builder_.caughtUp();
  if (builder_.hasUnasked() || mayRenew()) timeout = std::min(timeout, kCalm);
  if (delivery_.unfinished()) timeout = std::min(timeout, kSoon);
  auto delivery = link_.receive(busy ? std::chrono::milliseconds(0) : timeout);
  while (delivery) {
    worked = true;
    if (auto handled = handle(*delivery); !handled) return handled.error();
    delivery = link_.receive(std::chrono::milliseconds(0));
  }
  if (auto sent = delivery_.goOn(registry_); !sent) return sent.error();
  if (!builder_.caughtUp()) {
    if (auto fused = builder_.catchUp(kFusedAtOnce); !fused) return fused.error();
    return true;
  }
  if (!ingest_.hasNext() && !worked && unpublished_.empty() && builder_.hasUnasked() && store_health_.takes()) {
    if (auto asked = askNext(); !asked) return asked.error();
    return true;
  }
  if (!worked && !busy && unpublished_.empty()) {
    delivery_.noteHashes();
    if (mayRenew()) {
      renewNext();
      return true;
    }
  }
  if (!ingest_.hasNext() || !store_health_.takes()) return worked;
  if (auto mapped = mapNext(); !mapped) return mapped.error();
  return true;
}

Result<Keyframe> MappingService::read(const KeyframeId& id) {
  if (auto decoded = ingest_.takeDecoded(id)) return std::move(*decoded);
  const auto encoded = store_.encodedKeyframe(id);
  if (!encoded) return encoded.error();
  return decodeKeyframe(*encoded);
}

Pace MappingService::paceAt(CoreLoad::Clock::time_point now) const {
  if (options_.hurry_from_waiting > 0 && ingest_.waiting() >= options_.hurry_from_waiting) return Pace::kHasty;
  const double bound = options_.half_detail_from_load;
  return bound > 0 && load_.figure(now).load() >= bound ? Pace::kBrisk : Pace::kThorough;
}

Result<void> MappingService::mapNext() {
  const StageSpan span("keyframe");
  const auto start = std::chrono::steady_clock::now();
  const KeyframeId id = ingest_.takeNext();
  auto keyframe = read(id);
  if (!keyframe) return keyframe.error();
  ingest_.tieAcrossGaps(*keyframe);
  auto change = builder_.addKeyframe(*keyframe, robot_index_.at(id.robot), paceAt(start));
  if (!change) return change.error();
  ++keyframes_;
  // A robot catching up on earlier sessions is where its present one says.
  const bool present = registry_.served(id.robot, id.session) != nullptr;
  const auto latest = latest_.find(id.robot);
  if (latest == latest_.end() || id > latest->second.id || (present && id.session != latest->second.id.session))
    latest_[id.robot] = {id, keyframe->T_odom_cam};

  if (auto announced = announce(*change); !announced) return announced;
  const KeyframeId anchor = builder_.components().anchorOf(id);
  ++unpublished_[anchor];
  if (StageClock::process().traces())
    StageClock::process().note("mapped", Json{{"keyframe", toString(id)}, {"map", mapIdOf(anchor)}}.dump());
  const bool due = unpublished_[anchor] >= options_.tile_every_keyframes || !change->merges.empty();
  if (due && builder_.caughtUp())
    if (auto refreshed = refreshTilesOf(anchor); !refreshed) return refreshed;

  registry_.markMapped(id);
  if (RobotRecord* record = registry_.served(id.robot, id.session)) {
    send(Topic::kAck, id.robot, encodeAcknowledgement(acknowledgementOf(*record)));
  }
  publishStatus();
  last_mapped_ = std::chrono::steady_clock::now();
  statistics_.keyframe_ms.add(std::chrono::duration<double, std::milli>(last_mapped_ - start).count());
  load_.mapped(last_mapped_, last_mapped_ - start);
  adviseOnLoad();
  return {};
}

bool MappingService::mayRenew() const {
  const auto now = std::chrono::steady_clock::now();
  const bool idle = now - last_mapped_ > kIdle || load_.figure(now).load() < options_.half_detail_from_load / 2;
  return idle && builder_.coarse() && builder_.caughtUp();
}

// A keyframe of a map that was fused in half detail while there was no time for more. It is no more than a wish: what
// fails here ends nothing.
void MappingService::renewNext() {
  const auto renewed = builder_.renewCoarse(1);
  if (!renewed) {
    info("a map has half its detail until the end: " + renewed.error().text);
  } else if (*renewed) {
    info("map " + mapIdOf(**renewed) + " has all its detail");
    ++unpublished_[**renewed];
  }
}

// What a core in a hurry has put off. Whoever waits for tiles of what has changed comes first.
Result<void> MappingService::askNext() {
  const auto change = builder_.askNext();
  if (!change) return change.error();
  if (change->poses_changed || !change->merges.empty())
    for (const KeyframeId& anchor : builder_.components().anchors())
      if (mapIdOf(anchor) == change->map) ++unpublished_[anchor];
  return announce(*change);
}

Result<void> MappingService::announce(const MapChange& change) {
  for (const MatchVerdict& verdict : change.verdicts) {
    ++statistics_.verdicts[verdict.reason];
    send(Topic::kVerdict, "", encodeMatchVerdict(verdict));
  }
  announceMerges(change);
  std::erase_if(unpublished_,
                [&](const auto& entry) { return builder_.components().anchorOf(entry.first) != entry.first; });
  tiles_.keepOnly(builder_.components());
  return publishCorrections();
}

void MappingService::adviseOnLoad() {
  if (const auto advice = load_.advise(std::chrono::steady_clock::now(), ingest_.waiting())) info(*advice);
}

void MappingService::announceMerges(const MapChange& change) {
  statistics_.merges += change.merges.size();
  statistics_.merges_undone += change.undone.size();
  for (const MergeRecord& merge : change.merges) {
    info("maps " + merge.kept + " and " + merge.absorbed + " are one: " + std::to_string(merge.voters.size()) +
         " closures agree");
    delivery_.drop(merge.absorbed);
    send(Topic::kMerge, "", encodeMergeRecord(merge));
  }
  for (const MergeRecord& merge : change.undone) {
    info("maps " + merge.kept + " and " + merge.absorbed + " are two again: " + merge.undone);
    send(Topic::kMerge, "", encodeMergeRecord(merge));
  }
  for (const Confirmation& one : change.confirmed)
    info("merge " + std::to_string(one.merge) + " is beyond doubt: " + describe(one));
  if (change.undone.empty()) return;
  for (const KeyframeId& anchor : builder_.components().anchors()) ++unpublished_[anchor];
}

// A robot hears of its place when it is first mapped, when its map changes its name, and when the graph moved it.
Result<void> MappingService::publishCorrections() {
  constexpr double kMoved_m = 1e-3, kTurned_rad = 1e-4;
  for (const auto& [robot, latest] : latest_) {
    const auto it = registry_.robots().find(robot);
    if (it == registry_.robots().end() || it->second.session != latest.id.session) continue;
    Correction correction;
    correction.robot = robot;
    correction.session = latest.id.session;
    correction.map = mapIdOf(builder_.components().anchorOf(latest.id));
    correction.T_map_odom = builder_.poses().at(latest.id) * latest.T_odom_cam.inverse();
    auto& last = it->second.correction;
    if (last && last->map == correction.map) {
      const Pose change = last->T_map_odom.inverse() * correction.T_map_odom;
      if (change.translation().norm() < kMoved_m && change.angle() < kTurned_rad) continue;
    }
    correction.revision = (last ? last->revision : first_revision_) + 1;
    last = correction;
    send(Topic::kCorrection, robot, encodeCorrection(correction));
  }
  return {};
}

Result<void> MappingService::refreshTilesOf(const KeyframeId& anchor) {
  const StageSpan span("tiles");
  auto changed = tiles_.cut(builder_, anchor, delivery_.tiles());
  if (!changed) return changed.error();
  unpublished_.erase(anchor);
  return delivery_.renew(mapIdOf(anchor), std::move(*changed), registry_);
}

bool MappingService::quiet() const {
  constexpr std::chrono::milliseconds kWhile(300);
  return !ingest_.hasNext() && builder_.caughtUp() && std::chrono::steady_clock::now() - last_mapped_ > kWhile;
}

Result<void> MappingService::refreshTiles() {
  if (!builder_.caughtUp()) return {};  // half a map would take back tiles that are coming again
  while (!unpublished_.empty()) {
    const KeyframeId anchor = unpublished_.begin()->first;
    if (auto refreshed = refreshTilesOf(anchor); !refreshed) return refreshed;
  }
  return {};
}

Result<void> MappingService::finish(const std::function<void(size_t, size_t)>& progress) {
  const auto tell = [&] {
    if (progress) progress(keyframes_, keyframes_ + ingest_.waiting() + builder_.unfused());
  };
  if (!store_health_.holds()) return Error{ErrorCode::kUnreachable, store_health_.failure()};
  if (unpublished_.empty()) delivery_.noteHashes();  // what robots were given, before anything changes once more
  for (tell(); !builder_.caughtUp(); tell())
    if (auto fused = builder_.catchUp(kFusedAtOnce); !fused) return fused.error();
  for (; ingest_.hasNext(); tell())
    if (auto mapped = mapNext(); !mapped) return mapped;
  while (builder_.hasUnasked())
    if (auto asked = askNext(); !asked) return asked;
  if (builder_.recastDue()) {  // no keyframe came that would have begun with it
    const auto cast = builder_.recast();
    if (!cast) return cast.error();
    announceMerges(*cast);
  }
  for (const Confirmation& one : builder_.onProbation())
    info("merge " + std::to_string(one.merge) + " is still on probation: " + describe(one));
  const auto tiles = finishMaps(builder_, store_, options_.mapping.fusion.stable_confidence,
                                [&](FinishPhase, size_t done, size_t all) {
                                  if (progress) progress(done, all);
                                });
  if (!tiles) return tiles.error();
  const auto forgotten = store_.compactDue();
  if (!forgotten) return forgotten.error();
  if (*forgotten) {
    info("writes the store anew, without what was forgotten");
    if (auto compacted = store_.compact(); !compacted) info("not now, it stays due: " + compacted.error().text);
  }
  return store_.setMeta("complete", "yes");
}

void MappingService::send(Topic topic, const std::string& robot, const Result<std::vector<uint8_t>>& encoded) {
  // What does not get through is sent again: acknowledgements and corrections with the next one.
  if (!encoded) {
    info("message to '" + robot + "' not sent: " + encoded.error().text);
    return;
  }
  if (auto published = link_.publish(topic, robot, *encoded); !published)
    info("message to '" + robot + "' not sent: " + published.error().text);
}

}  // namespace comap
