#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <optional>

#include "fleet_tools/command_line/fail.h"
#include "fleet_tools/command_line/progress.h"
#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/command_line/verb.h"
#include "fleet_tools/store/record_json.h"
#include "fleet_tools/store/store_change.h"
#include "mapping_core/gpu/device.h"
#include "mapping_core/store/store_lock.h"
#include "mapping_core/store/store_survey.h"

namespace comap {
namespace {

struct RecoverArguments {
  std::string damaged;
  StoreChange change;  // of the new store
};

void removeStore(const std::string& path) {
  std::error_code ignored;
  for (const char* part : {"", "-wal", "-shm"}) std::filesystem::remove(path + part, ignored);
}

// Also no log of a store that is gone: SQLite would take what is in it for the new one's.
Result<void> checkFree(const std::string& path) {
  for (const char* part : {"", "-wal", "-shm"}) {
    std::error_code code;
    if (!std::filesystem::exists(std::filesystem::symlink_status(path + part, code))) continue;
    const std::string what = *part == '\0' ? ": is there already; choose a new name"
                                           : ": " + path + part + " is there, of another store; choose a new name";
    return Error{ErrorCode::kWrongUse, "--out " + path + what};
  }
  return {};
}

// What an interrupted run has left is begun anew; anything else of that name is somebody's.
Result<void> checkDraft(const std::string& store, const std::string& draft) {
  std::error_code code;
  const auto there = std::filesystem::symlink_status(draft, code);
  if (!std::filesystem::exists(there)) return {};
  constexpr std::string_view kMagic = "SQLite format 3";
  std::string start(kMagic.size(), '\0');
  if (std::filesystem::is_regular_file(there)) {
    std::ifstream file(draft, std::ios::binary);
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    start.resize(static_cast<size_t>(file.gcount()));
    // SQLite writes the first page last: until then it is a hole.
    if (start == kMagic || start.find_first_not_of('\0') == std::string::npos) return {};
  }
  return Error{ErrorCode::kWrongUse, "--out " + store + ": is made as " + draft +
                                         " first, and what is there is no half of a store; choose another name"};
}

// A name that outlives a loss of power must not be that of half a file.
Result<void> synchronise(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = file >= 0 && ::fsync(file) == 0;
  const int why = errno;
  if (file >= 0) ::close(file);
  return done ? Result<void>()
              : Error{ErrorCode::kUnreachable, path + ": cannot be synchronised: " + std::strerror(why)};
}

// What has come to be there meanwhile is not written over.
Result<void> moveTo(const std::string& draft, const std::string& path) {
  if (auto free = checkFree(path); !free) return free;
  if (auto durable = synchronise(draft); !durable) return durable;
  if (renameat2(AT_FDCWD, draft.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE) == 0) return {};
  if (errno == EINVAL && std::rename(draft.c_str(), path.c_str()) == 0) return {};  // a file system without that flag
  return Error{ErrorCode::kUnreachable, draft + ": cannot be renamed to " + path + ": " + std::strerror(errno)};
}

// Under another name until all that is whole is in it: half of it would look like a whole store.
class Draft {
 public:
  static std::string pathFor(const std::string& store) { return store + ".part"; }
  explicit Draft(const std::string& store) : path_(pathFor(store)) { removeStore(path_); }  // of one interrupted
  Draft(const Draft&) = delete;
  Draft& operator=(const Draft&) = delete;
  ~Draft() { removeStore(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

// It is copied while it is looked at: most stores are whole but for a few rows, if any.
Result<StoreSurvey> save(const RecoverArguments& arguments) {
  if (arguments.change.store.empty()) return Error{ErrorCode::kWrongUse, "--out: a name is expected"};
  if (auto free = checkFree(arguments.change.store); !free) return free.error();
  std::error_code none;
  if (std::filesystem::equivalent(arguments.damaged, Draft::pathFor(arguments.change.store), none))
    return Error{ErrorCode::kWrongUse, "--out " + arguments.change.store + ": is made as " + arguments.damaged +
                                           " first, which is the damaged store; choose another name"};
  if (auto free = checkDraft(arguments.change.store, Draft::pathFor(arguments.change.store)); !free)
    return free.error();
  const auto lock = StoreLock::take(arguments.damaged);
  if (!lock) return lock.error();
  const Draft draft(arguments.change.store);
  auto copied = std::async(std::launch::async, copyUnseen, arguments.damaged, draft.path());
  auto survey = [&] {
    Progress progress("reading keyframes");
    const auto show = [&](size_t done, size_t all) { progress.show(done, all); };
    return surveyStore(arguments.damaged, show, SurveyDepth::kRows);
  }();
  const bool is_copied = copied.get();
  if (!survey) return survey;
  if (survey->keyframes.empty() && !survey->damage.empty())
    return Error{ErrorCode::kProblem, arguments.damaged + ": no keyframe can be saved, " +
                                          counted(survey->lost_keyframes, "keyframe") +
                                          " lost; 'fleet doctor' tells what is damaged"};
  if (auto saved = saveWhole(*survey, draft.path(), is_copied); !saved) return saved.error();
  if (auto moved = moveTo(draft.path(), arguments.change.store); !moved) return moved.error();
  return survey;
}

// Before anything is written, so that the same command can be given again.
Result<void> checkDevice(const StoreChange& change) {
  if (change.later) return {};
  gpu::DeviceOptions options;
  options.choice = change.device;
  const auto device = gpu::Device::create(options);
  return device ? Result<void>() : Result<void>(device.error());
}

int run(const RecoverArguments& arguments) {
  const auto config = configOf(arguments.change);
  if (!config) return failWith(config.error());
  if (auto checked = checkDevice(arguments.change); !checked) return failWith(checked.error());
  const auto survey = save(arguments);
  if (!survey) return failWith(survey.error());
  if (!arguments.change.json) {
    for (const std::string& text : survey->damage) std::printf("damage: %s\n", printable(text).c_str());
    std::printf("whole: %zu keyframes, %zu edges, %zu verdicts, %zu merges; saved in %s\n", survey->keyframes.size(),
                survey->edges.size(), survey->verdicts.size(), survey->merges.size(), arguments.change.store.c_str());
  }
  auto store = MapStore::open(arguments.change.store, MapStore::Mode::kOpen);
  if (!store) return failWith(store.error());
  // What lost its ties falls apart, and what accepted matches still say joins it again.
  return followUp(arguments.change, *config, *store,
                  {{"keyframes", survey->keyframes.size()},
                   {"lost_keyframes", survey->lost_keyframes},
                   {"damage", survey->damage}});
}

}  // namespace

void addRecoverVerb(CLI::App& app, int& exit_code) {
  auto* verb = app.add_subcommand("recover", "Save what is whole of a damaged store into a new one");
  verb->footer(
      "The damaged store stays as it is. Poses, surfels and tiles are computed anew from the keyframes and edges that\n"
      "could be saved; a map whose ties are lost comes out in parts. Robots whose outbox still holds what was lost\n"
      "deliver it to a core on the new store only if the core had not yet acknowledged it.\n"
      "Example: fleet recover flat.comap --out flat-saved.comap");
  auto arguments = std::make_shared<RecoverArguments>();
  verb->add_option("STORE", arguments->damaged, "Damaged map store that no core is writing")->required();
  verb->add_option("--out", arguments->change.store, "New store")->required();
  addStoreChangeOptions(*verb, arguments->change);
  verb->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace comap
