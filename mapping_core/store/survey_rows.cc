#include "mapping_core/store/survey_rows.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <sstream>

#include "mapping_core/store/packed_numbers.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/schema_3.h"
#include "mapping_core/store/store_leavings.h"
#include "mapping_core/store/store_log.h"
#include "mapping_core/store/store_survey.h"

namespace comap {
namespace {

constexpr int64_t kBlindRows = 20'000;  // looked for behind the last one, if the table does not tell how many it has
constexpr int64_t kMostRows = 100'000'000;  // a damaged number may be any

// Rows one behind the other that fail for the same reason, as one sentence.
class Failures {
 public:
  Failures(std::string what, std::vector<std::string>& damage) : what_(std::move(what)), damage_(damage) {}
  ~Failures() { tell(); }
  /// Whether there are so many rows is not known beyond `last`.
  void guessedUntil(int64_t last) { guessed_ = last; }
  size_t count() const { return all_; }
  void add(int64_t number, const std::string& reason) {
    if (count_ > 0 && (number != last_ + 1 || reason != reason_)) tell();
    if (count_++ == 0) first_ = number;
    ++all_;
    last_ = number;
    reason_ = reason;
  }

 private:
  void tell() {
    if (count_ == 0) return;
    const std::string range = last_ == guessed_ ? " and those after it" : " to " + std::to_string(last_);
    damage_.push_back(what_ + " " + std::to_string(first_) + (count_ > 1 ? range : "") + ": " + reason_);
    count_ = 0;
  }

  const std::string what_;
  std::vector<std::string>& damage_;
  int64_t first_ = 0, last_ = 0, count_ = 0, guessed_ = -1;
  size_t all_ = 0;
  std::string reason_;
};

// Without the path, which stands before the whole list.
std::string reasonOf(const Error& error, const Database& database) {
  const std::string prefix = database.path() + ": ";
  return error.text.starts_with(prefix) ? error.text.substr(prefix.size()) : error.text;
}

Result<bool> checkOne(Database& database, const char* one, int64_t number, const RowCheck& check) {
  auto query = database.query(one);
  if (!query) return query.error();
  const auto there = query->bind(number).step();
  if (!there) return there.error();
  if (!*there) return false;
  if (auto passed = check(number, *query); !passed) return passed.error();
  return true;
}

// Returns the number from which on rows are to be asked for one by one, as the tree itself is damaged; nothing if all
// could be read.
std::optional<int64_t> goAlong(Database& database, const char* all, const RowCheck& check, KeptRows& kept,
                               Failures& failures) {
  int64_t next = 0;
  auto query = database.query(all);
  if (!query) return next;
  for (;;) {
    const auto row = query->step();
    if (!row) return next;
    if (!*row) return std::nullopt;
    const int64_t number = query->integer();
    if (number < next || number == std::numeric_limits<int64_t>::max()) return next;  // no such row was ever written
    next = number + 1;
    if (const auto passed = check(number, *query); passed) {
      kept.add(number);
    } else {
      kept.skip();
      failures.add(number, reasonOf(passed.error(), database));
      query->forgive();
    }
  }
}

struct Asked {
  int64_t last = 0;   // number that was asked for
  bool known = true;  // that the table has so many
  bool none = false;  // not a single one could be read
};

Asked askForEach(Database& database, const TableRows& rows, int64_t first, const Result<int64_t>& last,
                 const RowCheck& check, KeptRows& kept, Failures& failures) {
  Asked asked;
  asked.known = last && *last >= 0 && *last <= kMostRows;
  asked.last = asked.known ? *last : kBlindRows;
  asked.none = true;
  for (int64_t number = first; number <= asked.last; ++number) {
    const auto whole = checkOne(database, rows.one, number, check);
    if (whole) asked.none = false;
    if (whole && *whole && !asked.known) asked.last = std::max(asked.last, number + kBlindRows);
    if (whole && *whole) kept.add(number);
    if (whole) continue;
    kept.skip();
    failures.add(number, reasonOf(whole.error(), database));
  }
  if (!asked.known) failures.guessedUntil(asked.last);
  return asked;
}

}  // namespace

bool hasLog(Database& database) {
  auto mode = database.query("PRAGMA journal_mode");
  return mode && mode->step() && mode->text() == "wal";
}

std::string cutOffText(const std::string& path) {
  constexpr std::streamoff kPageSizeAt = 16, kPagesAt = 28;
  std::error_code code;
  // Pages may be in its log. An empty one is made by whoever looks into a store that was not closed.
  if (const auto log_bytes = std::filesystem::file_size(path + "-wal", code); !code && log_bytes > 0) return "";
  std::ifstream file(path, std::ios::binary);
  const auto number = [&](std::streamoff at, int bytes) {
    uint64_t value = 0;
    file.seekg(at);
    for (int i = 0; i < bytes; ++i) value = value << 8 | static_cast<uint8_t>(file.get());
    return value;
  };
  const uint64_t told = number(kPageSizeAt, 2), pages = number(kPagesAt, 4);
  const uint64_t page_bytes = told == 1 ? 65536 : told;
  const uint64_t bytes = std::filesystem::file_size(path, code);
  if (!file || code || page_bytes * pages <= bytes) return "";
  return "the file is cut off: it has " + std::to_string(bytes) + " bytes, and its head tells of " +
         std::to_string(page_bytes * pages) + ": " + std::to_string(pages - bytes / page_bytes) + " of " +
         std::to_string(pages) + " pages are missing";
}

Result<Database> openDamaged(const std::string& path) {
  std::error_code none;
  const auto status = std::filesystem::status(path, none);
  if (!std::filesystem::is_regular_file(status))
    return Error{ErrorCode::kUnreachable,
                 path + (std::filesystem::is_directory(status) ? ": is a folder, expected a map store"
                         : std::filesystem::exists(status)     ? ": is no regular file, expected a map store"
                                                               : ": no such file")};
  auto database = Database::open(std::filesystem::absolute(path).string(), SQLITE_OPEN_READONLY);
  if (!database) return database;
  if (!cutOffText(path).empty()) database->bearDamage();
  if (auto shown = showAsNewest(*database, "main", ""); !shown) return shown.error();
  return database;
}

Result<void> atOneMoment(const std::string& path, const std::function<Result<void>(Database&)>& look) {
  constexpr int kMostTimes = 3;
  const LeavingsGuard guard(path);
  for (int times = 1;; ++times) {
    auto database = openDamaged(path);
    if (!database) return database.error();
    // In its log a core may write on; without one, a core could not start while a transaction is held.
    const bool logged = hasLog(*database);
    if (logged)
      if (auto begun = database->execute("BEGIN"); !begun) return begun.error();
    const auto before = database->integer("PRAGMA data_version");
    if (auto looked = look(*database); !looked) return looked;
    const auto after = database->integer("PRAGMA data_version");
    const bool changed = !logged && before && after && *before != *after;
    if (!changed || times == kMostTimes) return {};
  }
}

Result<bool> showAsNewest(Database& database, const std::string& schema, const std::string& prefix) {
  auto version = database.query("PRAGMA " + schema + ".user_version");
  auto row = version ? version->step() : Result<bool>(version.error());
  // What cannot be read, or is no store, is told of by whoever looks into it.
  if (!row || !*row || version->integer() >= kStoreVersion) return false;
  if (auto added = addPacked(database); !added) return added.error();
  if (auto shown = showAs4(database, schema, prefix); !shown) return shown.error();
  return true;
}

void tellDeclarations(Database& database, std::vector<std::string>& damage) {
  const auto version = database.integer("PRAGMA user_version");
  if (!version || *version != kStoreVersion) return;
  const auto declared = declaresTables(database);
  if (!declared || !*declared)
    damage.push_back("its tables are not declared as this program declares them" +
                     (declared ? std::string() : ": " + declared.error().text));
}

void tellLogEnd(const std::string& path, std::vector<std::string>& damage, std::vector<std::string>& remarks) {
  const LogEnd end = lookAtLog(path);
  if (!end.damage.empty()) damage.push_back(end.damage);
  if (!end.remark.empty()) remarks.push_back(end.remark);
}

void remarkCompactDue(Database& database, std::vector<std::string>& remarks) {
  const auto due = database.integer("SELECT count(*) FROM meta WHERE key = 'compact_due'");
  if (due && *due > 0)  // one that cannot be read is told of by those who look for damage
    remarks.push_back("what was forgotten is overwritten; 'fleet finish' writes the file anew without it");
}

Result<void> checkRow(const Query& row, std::string_view types) {
  switch (row.rowState(types)) {
    case RowState::kMistyped:
      return Error{ErrorCode::kBadData, "a value of it is of another type than its column"};
    case RowState::kUnsound:
      return Error{ErrorCode::kBadData, kUnsound};
    case RowState::kSound:
      break;
  }
  return {};
}

void addLines(const std::string& prefix, const std::string& text, std::vector<std::string>& damage) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) damage.push_back(prefix + line);
}

size_t surveyTable(Database& database, const std::string& what, const TableRows& rows, const RowCheck& check,
                   std::vector<std::string>& damage, KeptRows& kept) {
  std::vector<std::string> sentences;
  size_t failed = 0;
  {
    Failures failures(what, sentences);
    if (const auto first = goAlong(database, rows.all, check, kept, failures)) {
      kept.leaveOrder();
      const auto last = database.integer(rows.last);
      const Asked asked = askForEach(database, rows, *first, last, check, kept, failures);
      const std::string why = last ? "" : " (" + reasonOf(last.error(), database) + ")";
      if (!last && asked.none && *first == 0) {
        damage.push_back(what + "s: none can be read" + why);
        return 0;
      }
      // Each row that is asked for may be whole and the others be nowhere: then no failure tells of it.
      damage.push_back(what + "s: " + kOutOfOrder);
      if (!asked.known) damage.push_back(what + "s: how many there are cannot be read" + why);
    }
    failed = failures.count();
  }
  damage.insert(damage.end(), sentences.begin(), sentences.end());
  return failed;
}

}  // namespace comap
