#include "mapping_core/store/survey_rows.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>

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
  void add(int64_t number, const std::string& reason) {
    if (count_ > 0 && (number != last_ + 1 || reason != reason_)) tell();
    if (count_++ == 0) first_ = number;
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
  std::string reason_;
};

// Without the path, which stands before the whole list.
std::string reasonOf(const Error& error, const Database& database) {
  const std::string prefix = database.path() + ": ";
  return error.text.starts_with(prefix) ? error.text.substr(prefix.size()) : error.text;
}

Result<bool> checkRow(Database& database, const char* one, int64_t number, const RowCheck& check) {
  auto query = database.query(one);
  if (!query) return query.error();
  const auto there = query->bind(number).step();
  if (!there) return there.error();
  if (!*there) return false;
  if (auto passed = check(number, *query); !passed) return passed.error();
  return true;
}

bool hasLog(Database& database) {
  auto mode = database.query("PRAGMA journal_mode");
  return mode && mode->step() && mode->text() == "wal";
}

// The number from which on rows are to be asked for one by one; nothing if all were read and are whole.
std::optional<int64_t> readToDamage(Database& database, const char* all, const RowCheck& check, KeptRows& kept) {
  int64_t next = 0;
  auto query = database.query(all);
  if (!query) return next;
  for (;;) {
    const auto row = query->step();
    if (!row) return next;
    if (!*row) return std::nullopt;
    const int64_t number = query->integer();
    if (number < next || !check(number, *query)) return next;  // out of order: the tree itself is damaged
    kept.add(number);
    next = number + 1;
  }
}

}  // namespace

std::string cutOffText(const std::string& path) {
  constexpr std::streamoff kPageSizeAt = 16, kPagesAt = 28;
  std::error_code code;
  if (std::filesystem::exists(path + "-wal", code)) return "";  // pages may be in its log
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
         std::to_string(page_bytes * pages);
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
  if (!cutOffText(path).empty()) database->readCutOff();
  if (auto added = database->addReals(); !added) return added.error();
  return database;
}

Result<void> atOneMoment(const std::string& path, const std::function<Result<void>(Database&)>& look) {
  constexpr int kMostTimes = 3;
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

void remarkCompactDue(Database& database, std::vector<std::string>& remarks) {
  const auto due = database.integer("SELECT count(*) FROM meta WHERE key = 'compact_due'");
  if (due && *due > 0)  // one that cannot be read is told of by those who look for damage
    remarks.push_back("what was forgotten is overwritten; 'fleet finish' writes the file anew without it");
}

void addLines(const std::string& prefix, const std::string& text, std::vector<std::string>& damage) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) damage.push_back(prefix + line);
}

size_t surveyTable(Database& database, const std::string& what, const TableRows& rows, const RowCheck& check,
                   std::vector<std::string>& damage, KeptRows& kept) {
  const auto first = readToDamage(database, rows.all, check, kept);
  if (!first) return 0;
  kept.skip();
  const auto told = database.integer(rows.last);
  const bool known = told && *told >= 0 && *told <= kMostRows;
  int64_t end = known ? *told : kBlindRows;
  if (!known)
    damage.push_back(what + "s: how many there are cannot be read" +
                     (told ? "" : " (" + reasonOf(told.error(), database) + ")"));
  size_t failed = 0;
  std::vector<std::string> sentences;
  {
    Failures failures(what, sentences);
    for (int64_t number = *first; number <= end; ++number) {
      const auto whole = checkRow(database, rows.one, number, check);
      if (whole && *whole && !known) end = std::max(end, number + kBlindRows);
      if (whole && *whole) kept.add(number);
      if (whole) continue;
      kept.skip();
      ++failed;
      failures.add(number, reasonOf(whole.error(), database));
    }
    if (!known) failures.guessedUntil(end);
  }
  if (failed == static_cast<size_t>(end) + 1 && !told) {
    damage.back() = what + "s: none can be read (" + reasonOf(told.error(), database) + ")";
    return 0;
  }
  damage.insert(damage.end(), sentences.begin(), sentences.end());
  return failed;
}

}  // namespace comap
