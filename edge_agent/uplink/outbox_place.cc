#include "edge_agent/uplink/outbox_place.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr uint32_t kMostInMemory_mb = 256;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

std::string usualDirectory() {
  if (const std::string given = environment("STATE_DIRECTORY"); !given.empty()) return given.substr(0, given.find(':'));
  if (const std::string state = environment("XDG_STATE_HOME"); !state.empty()) return state + "/comap";
  if (const std::string home = environment("HOME"); !home.empty()) return home + "/.local/state/comap";
  return {};
}

constexpr const char* kWhatToDo =
    "; name a folder that this user can write with outbox.directory or --outbox DIR, or give up safety with --outbox "
    "memory";

// What SQLite would take for a new one, or tell no reason of.
Result<void> lookAt(const std::string& path, const std::function<void(const std::string& line)>& log) {
  namespace fs = std::filesystem;
  std::error_code none;
  if (auto regular = checkRegular(path); !regular)
    return Error{ErrorCode::kUnreachable, "outbox: " + regular.error().text + kWhatToDo};
  const bool there = fs::exists(path, none);
  if (!there && fs::is_symlink(fs::symlink_status(path, none)))
    return Error{ErrorCode::kUnreachable, "outbox: " + path + ": is a link to " +
                                              fs::read_symlink(path, none).string() +
                                              ", which is not there, expected a regular file or none" + kWhatToDo};
  if (!there || fs::file_size(path, none) > 0) return {};
  if (const auto logged = fs::file_size(path + "-wal", none); !none && logged > 0)
    return Error{ErrorCode::kBadData, path + ": has 0 bytes, and its log has " + std::to_string(logged)};
  log("outbox " + path +
      ": has 0 bytes and begins anew; if it is of an earlier start that made keyframes, they are lost");
  return {};
}

Result<BegunOutbox> beginIn(Result<Outbox> outbox, const std::string& robot, uint64_t wished_session) {
  if (!outbox) return outbox.error();
  if (auto owned = outbox->belongTo(robot); !owned) return owned.error();
  const auto session = outbox->beginSession(wished_session);
  if (!session) return session.error();
  return BegunOutbox{std::move(*outbox), *session};
}

}  // namespace

uint64_t quotaBytes(const OutboxOptions& options) {
  const uint32_t mb = options.kind == "memory" ? std::min(options.quota_mb, kMostInMemory_mb) : options.quota_mb;
  return uint64_t{mb} * 1'000'000;
}

Result<std::string> outboxPath(const OutboxOptions& options, const std::string& robot) {
  const std::string directory = options.directory.empty() ? usualDirectory() : options.directory;
  if (directory.empty())
    return Error{ErrorCode::kWrongUse, std::string("outbox.directory is not set, nor is $HOME") + kWhatToDo};
  return (std::filesystem::absolute(directory) / (robot + ".outbox")).lexically_normal().string();
}

Result<BegunOutbox> openOutbox(const OutboxOptions& options, const std::string& robot, uint64_t wished_session,
                               const std::function<void(const std::string& line)>& log) {
  const auto begin = [&](Result<Outbox> outbox) { return beginIn(std::move(outbox), robot, wished_session); };
  if (options.kind == "memory") return begin(Outbox::inMemory());
  const auto path = outboxPath(options, robot);
  if (!path) return path.error();
  std::error_code code;
  const auto directory = std::filesystem::path(*path).parent_path();
  std::filesystem::create_directories(directory, code);
  if (code)
    return Error{ErrorCode::kUnreachable,
                 "outbox.directory " + directory.string() + ": cannot be made: " + code.message() + kWhatToDo};
  const auto looked = lookAt(*path, log);
  if (!looked && looked.error().code != ErrorCode::kBadData) return looked.error();
  auto begun = looked ? begin(Outbox::open(*path)) : Result<BegunOutbox>(looked.error());
  if (!begun && begun.error().code == ErrorCode::kBadData) {
    log("outbox: " + begun.error().text);
    auto rescued = rescueOutbox(*path);
    if (!rescued) return rescued.error();
    log(rescued->told);
    begun = begin(std::move(rescued->outbox));
    if (begun) begun->lost = static_cast<uint32_t>(rescued->lost.size());
    if (begun) begun->more_lost = rescued->holes;
  }
  if (!begun && begun.error().code == ErrorCode::kUnreachable && begun.error().text.find("locked") == std::string::npos)
    return Error{begun.error().code, "outbox: " + begun.error().text + kWhatToDo};
  return begun;
}

}  // namespace comap
