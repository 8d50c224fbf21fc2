#include "edge_agent/agent_run.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "protocol/types/counted.h"

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

Result<void> awaitCore(const Link& link, const AgentConfig& config, const RunOptions& options) {
  const auto deadline = Clock::now() + seconds(options.patience_s);
  while (link.peers() == 0 && !options.stopped()) {
    if (Clock::now() > deadline)
      return Error{ErrorCode::kUnreachable,
                   "no mapping core answers in site '" + config.link.site + "', DDS domain " +
                       std::to_string(config.link.domain) + " on " + config.link.interface_address + " after " +
                       std::to_string(options.patience_s) + " s: is it running, with the same site and domain?"};
    options.tell();
    std::this_thread::sleep_for(milliseconds(20));
  }
  return {};
}

Error silentCore(Agent& agent, const RunOptions& options) {
  agent.saveToDisk();
  const RefusedKeyframes& refused = agent.refusedKeyframes();
  if (refused.size() > 0)
    return {ErrorCode::kProblem, "the core refuses " + counted(refused.size(), "keyframe") + ": " + refused.reason() +
                                     "; " + whatWaits(agent, options.outbox)};
  return {ErrorCode::kUnreachable, "the core has been silent for " + std::to_string(options.patience_s) + " s; " +
                                       whatWaits(agent, options.outbox)};
}

// While frames come. Recorded sources play as fast as the core keeps up, or at their own speed; a camera has its own.
Result<void> drive(Agent& agent, const RunOptions& options) {
  const bool realtime = options.realtime && !options.live,
             in_time = options.realtime || options.live || options.offline;
  const auto start = Clock::now();
  auto last_progress = start;
  uint32_t frames = 0;
  uint32_t unacknowledged = 0;
  while (!options.stopped()) {
    options.tell();
    const auto taken = agent.takeFrame();
    if (!taken) return taken.error();
    if (*taken == Agent::Progress::kEnded) return {};
    if (auto exchanged = agent.exchange(milliseconds(*taken == Agent::Progress::kWaiting ? 20 : 0)); !exchanged)
      return exchanged;
    if (*taken == Agent::Progress::kFrame || agent.unacknowledged() != unacknowledged) last_progress = Clock::now();
    unacknowledged = agent.unacknowledged();
    if (!in_time && Clock::now() - last_progress > seconds(options.patience_s)) return silentCore(agent, options);
    const AgentStatistics& taken_so_far = agent.statistics();
    if (!realtime || taken_so_far.frames == frames) continue;
    frames = taken_so_far.frames;
    const auto due = start + std::chrono::nanoseconds(taken_so_far.last_stamp_ns - taken_so_far.first_stamp_ns);
    if (const auto now = Clock::now(); now > due) options.late(now - due, frames);
    while (Clock::now() < due && !options.stopped()) {
      options.tell();
      const auto left = std::chrono::duration_cast<milliseconds>(due - Clock::now()) + milliseconds(1);
      if (auto exchanged = agent.exchange(std::min(left, milliseconds(1000))); !exchanged) return exchanged;
    }
  }
  return agent.closeKeyframe();
}

// After the last frame: until the core has all keyframes in its map and no more tiles come.
Result<void> settle(Agent& agent, const RunOptions& options) {
  constexpr milliseconds kInterestPeriod(500), kQuiet(2500);
  auto last_progress = Clock::now(), last_news = Clock::now(), last_interest = Clock::now() - kInterestPeriod;
  uint32_t unacknowledged = agent.unacknowledged();
  uint32_t mapped = agent.mappedBelow();
  uint64_t tiles = agent.statistics().tiles_received;
  while (!options.stopped()) {
    options.tell();
    const auto now = Clock::now();
    if (now - last_interest >= kInterestPeriod) {
      agent.sendInterest();
      agent.sendStatus(agent.allAcknowledged());
      last_interest = now;
    }
    if (auto exchanged = agent.exchange(milliseconds(50)); !exchanged) return exchanged;
    if (agent.unacknowledged() != unacknowledged || agent.mappedBelow() != mapped) {
      unacknowledged = agent.unacknowledged();
      mapped = agent.mappedBelow();
      last_progress = last_news = Clock::now();
    }
    if (agent.statistics().tiles_received != tiles) {
      tiles = agent.statistics().tiles_received;
      last_news = Clock::now();
    }
    const bool only_refused =
        agent.refusedKeyframes().size() > 0 && agent.refusedKeyframes().size() == agent.unacknowledged();
    if (only_refused && Clock::now() - last_news > kQuiet) return silentCore(agent, options);
    if (agent.allAcknowledged() && agent.allMapped() && Clock::now() - last_news > kQuiet) return {};
    if (Clock::now() - last_progress > seconds(options.patience_s)) {
      if (agent.allAcknowledged()) return {};
      return silentCore(agent, options);
    }
  }
  return {};
}

// With what the link knows of why nobody answers.
Result<void> explained(Result<void> done, const Link& link) {
  if (done || done.error().code != ErrorCode::kUnreachable || link.trouble().empty()) return done;
  return Error{ErrorCode::kUnreachable, done.error().text + "; " + link.trouble()};
}

}  // namespace

std::string whatWaits(const Agent& agent, const std::string& outbox) {
  const size_t waiting = agent.unacknowledged(), lost = agent.onlyInMemory();
  const std::string count = counted(waiting, "keyframe");
  if (outbox.empty())
    return count + wordFor(waiting, " is not acknowledged by the core: it is lost",
                           " are not acknowledged by the core: they are lost");
  std::string text = count + wordFor(waiting, " waits in ", " wait in ") + outbox + " and " +
                     wordFor(waiting, "is sent by the next start", "are sent by the next start");
  if (lost > 0)
    text += ", except " + std::to_string(lost) +
            " that could not be written there: " + wordFor(lost, "it is lost", "they are lost");
  const std::string stays = whatStays(agent, outbox);
  return text + (stays.empty() ? "" : "; ") + stays;
}

std::string whatStays(const Agent& agent, const std::string& outbox) {
  const size_t there = agent.deliveredButThere();
  if (there == 0) return "";
  return counted(there, "keyframe") + " that the core holds could not be taken out of " + outbox +
         ": the next start, which needs room there, sends " + wordFor(there, "it", "them") +
         " once more, and the core takes no notice";
}

std::string whatIsLost(const Agent& agent, bool more_lost) {
  const uint32_t lost = agent.losses().damaged;
  if (lost == 0 && !more_lost) return "";
  const std::string how = " with a damaged outbox", where = "; the lines before tell more";
  if (lost == 0) return "keyframes of earlier starts are perhaps lost" + how + where;
  return counted(lost, "keyframe") + wordFor(lost, " is lost", " are lost") + how +
         (more_lost ? ", and perhaps more" : "") + where;
}

Result<void> runAgent(Agent& agent, const Link& link, const AgentConfig& config, const RunOptions& options) {
  if (auto greeted = agent.hello(); !greeted) return greeted;
  if (!options.realtime && !options.live && !options.offline)
    if (auto found = awaitCore(link, config, options); !found) return explained(found, link);
  auto done = drive(agent, options);
  if (done && !options.offline) done = settle(agent, options);
  agent.saveToDisk();
  return explained(std::move(done), link);
}

}  // namespace comap
