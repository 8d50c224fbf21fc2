#include "mapping_core/store/store_glance.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <future>
#include <limits>
#include <set>

#include "mapping_core/store/keyframe_runs.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/small_tables.h"
#include "mapping_core/store/store_survey.h"
#include "mapping_core/store/survey_indexes.h"
#include "mapping_core/store/survey_keyframes.h"
#include "mapping_core/store/survey_rows.h"
#include "mapping_core/store/table_rows.h"
#include "mapping_core/store/tile_bytes.h"
#include "protocol/storage/first_page.h"

namespace comap {
namespace {

constexpr size_t kTold = 20;  // of one kind of damage

// Sentences of one kind, of which only the first are told.
class Told {
 public:
  Told(const char* what, std::vector<std::string>& damage) : what_(what), damage_(damage) {}
  ~Told() {
    if (count_ > kTold) damage_.push_back(std::to_string(count_ - kTold) + " more " + what_);
  }
  void add(const std::string& text) {
    if (++count_ <= kTold) damage_.push_back(text);
  }

 private:
  const char* what_;
  std::vector<std::string>& damage_;
  size_t count_ = 0;
};

struct SumCheck {
  const char* what;
  const char* sql;  // yields the number, or the name, of each row that does not fit its checksum
};
#define COMAP_UNSOUND(what, table, number, row) \
  SumCheck { what, "SELECT " number " FROM " table " WHERE checksum IS NOT row_sum(" row ")" }
constexpr SumCheck kSmall[] = {
    COMAP_UNSOUND("setting", "meta", "key", COMAP_META_ROW),
    COMAP_UNSOUND("robot", "robots", "name", COMAP_ROBOT_ROW),
    COMAP_UNSOUND("row of keyframe", "keyframes", "arrival", COMAP_KEYFRAME_ROW),
    COMAP_UNSOUND("pose of keyframe", "poses", "keyframe", COMAP_POSE_ROW),
    COMAP_UNSOUND("merge", "merges", "number", COMAP_MERGE_ROW),
    COMAP_UNSOUND("a robot of merge", "merge_robots", "merge", COMAP_MERGE_ROBOT_ROW),
    COMAP_UNSOUND("a voter of merge", "merge_voters", "merge", COMAP_MERGE_VOTER_ROW),
};

// A table that is too large for SQLite's check. Its index tells how many rows it has: a page that no longer counts some
// of its rows hides them without a word.
struct LargeTable {
  const char* what;
  const char* sql;      // number of each row, by number, whether it fits its checksum, and what `look` looks at
  const char* entries;  // yields how many the index has
};
#define COMAP_LARGE(what, table, index, row, more)                                      \
  LargeTable {                                                                          \
    what, "SELECT number, " COMAP_IS_SOUND(row) more " FROM " table " ORDER BY number", \
        "SELECT count(*) FROM main." table " INDEXED BY " index                         \
  }
constexpr LargeTable kEdges =
    COMAP_LARGE("edge", "edges", "sqlite_autoindex_edges_1", COMAP_EDGE_ROW, ", merge, withdrawn_by, kind");
constexpr LargeTable kVerdicts = COMAP_LARGE("verdict", "verdicts", "verdicts_by_reason", COMAP_VERDICT_ROW, "");

// Goes through the rows of a statement; what keeps it from the end is damage.
size_t eachRow(Database& database, const char* what, const char* sql, std::vector<std::string>& damage,
               const std::function<void(Query&)>& look) {
  auto query = database.query(sql);
  size_t rows = 0;
  Result<bool> row = query ? query->step() : Result<bool>(query.error());
  for (; row && *row; row = query->step(), ++rows) look(*query);
  if (!row) damage.push_back(std::string(what) + ": " + row.error().text);
  return rows;
}

void checkSums(Database& database, std::vector<std::string>& damage) {
  for (const SumCheck& check : kSmall) {
    Told unsound("of the same kind", damage);
    eachRow(database, check.what, check.sql, damage,
            [&](Query& row) { unsound.add(std::string(check.what) + " " + row.text() + ": " + kUnsound); });
  }
}

// Says so if a table has not as many rows as its index has entries.
void compareCounts(Database& database, const std::string& what, size_t rows, const char* entries,
                   std::vector<std::string>& damage) {
  const auto told = database.integer(entries);
  if (!told)
    damage.push_back("the index of the " + what + "s: " + told.error().text);
  else if (*told != static_cast<int64_t>(rows))
    damage.push_back(what + "s: " + std::to_string(rows) + " can be read, and their index tells of " +
                     std::to_string(*told));
}

void checkLargeTable(Database& database, const LargeTable& table, std::vector<std::string>& damage,
                     const std::function<void(int64_t number, Query&)>& look = {}) {
  Told unsound("of the same kind", damage);
  int64_t last = std::numeric_limits<int64_t>::min();
  bool in_order = true;
  const size_t rows = eachRow(database, table.what, table.sql, damage, [&](Query& row) {
    const int64_t number = row.integer();
    in_order = in_order && number > last;
    last = number;
    if (row.integer() != 1) unsound.add(std::string(table.what) + " " + std::to_string(number) + ": " + kUnsound);
    if (look) look(number, row);
  });
  if (!in_order) damage.push_back(std::string(table.what) + "s: " + kOutOfOrder);
  compareCounts(database, table.what, rows, table.entries, damage);
}

// With the indexes of the few edges that were withdrawn or are closures of merges, entry by entry.
void checkEdges(Database& database, std::vector<std::string>& damage) {
  IndexEntries rows;
  checkLargeTable(database, kEdges, damage, [&](int64_t number, Query& row) {
    const int64_t merge = row.integer(), withdrawn_by = row.integer();
    if (merge != 0 || withdrawn_by != 0) addPartialEntries(rows, number, row.textView(), merge, withdrawn_by);
  });
  if (!readWithdrawnEdges(database).says(rows.withdrawn_edges) || !readEdgesOfMerges(database).says(rows.edges_of_merges))
    damage.push_back("an index of the edges does not say what they say");
}

// On a connection of its own, beside the rest: a table and its index are of one moment, as are all its rows.
std::vector<std::string> checkLargeTables(const std::string& path) {
  std::vector<std::string> damage;
  auto database = openDamaged(path);
  if (!database) return {database.error().text};
  if (hasLog(*database))
    if (auto begun = database->execute("BEGIN"); !begun) return {begun.error().text};
  checkEdges(*database, damage);
  checkLargeTable(*database, kVerdicts, damage);
  return damage;
}

// None is read: they are in order, and of keyframes that are there. `numbers`: of all keyframes.
void checkMessageNumbers(Database& database, const std::vector<int64_t>& numbers, std::vector<std::string>& damage) {
  Told strangers("messages of no keyframe", damage);
  const std::set<int64_t> known(numbers.begin(), numbers.end());
  int64_t last = std::numeric_limits<int64_t>::min();
  bool in_order = true;
  eachRow(database, "pictures", "SELECT keyframe FROM keyframe_messages ORDER BY keyframe", damage, [&](Query& row) {
    const int64_t number = row.integer();
    in_order = in_order && number > last;
    last = number;
    if (!known.contains(number)) strangers.add("message " + std::to_string(number) + ": there is no such keyframe");
  });
  if (!in_order) damage.push_back(std::string("pictures: ") + kOutOfOrder);
}

void lookAtKeyframes(Database& database, StoreGlance& glance, KeyframeRuns& known, std::vector<int64_t>& numbers) {
  std::set<std::string> robots;
  eachRow(database, "robots", "SELECT name FROM robots", glance.damage, [&](Query& row) { robots.insert(row.text()); });
  Told strangers("keyframes of unknown robots", glance.damage);
  eachRow(database, "keyframes", "SELECT arrival, robot, session, sequence FROM keyframes ORDER BY arrival",
          glance.damage, [&](Query& row) {
            numbers.push_back(row.integer());
            const KeyframeId id = row.keyframeId();
            if (!robots.contains(id.robot)) strangers.add("keyframe " + toString(id) + " is of no known robot");
            known.add(id);
          });
  glance.keyframes = numbers.size();
  Told missing("keyframes without a message", glance.damage);
  eachRow(database, "pictures",
          "SELECT robot, session, sequence FROM keyframes WHERE NOT EXISTS (SELECT 1 FROM keyframe_messages WHERE "
          "keyframe = arrival)",
          glance.damage,
          [&](Query& row) { missing.add("keyframe " + toString(row.keyframeId()) + ": its message is not there"); });
  checkMessageNumbers(database, numbers, glance.damage);
  Told poses("poses of no keyframe", glance.damage);
  eachRow(database, "poses",
          "SELECT keyframe FROM poses WHERE NOT EXISTS (SELECT 1 FROM keyframes WHERE arrival = keyframe)",
          glance.damage, [&](Query& row) {
            poses.add("pose of keyframe " + std::to_string(row.integer()) + ": there is no such keyframe");
          });
}

// Of a statement whose rows begin with two keyframes.
size_t lookAtEnds(Database& database, const char* what, const char* sql, const KeyframeRuns& known,
                  StoreGlance& glance) {
  Told loose("of the same kind", glance.damage);
  return eachRow(database, what, sql, glance.damage, [&](Query& row) {
    for (int end = 0; end < 2; ++end) {
      const KeyframeId id = row.keyframeId();
      if (!known.contains(id))
        loose.add(std::string(what) + ": one names keyframe " + toString(id) + ", which is not there");
    }
  });
}

// Up to `most` of `all`, evenly, the last one among them.
template <class Value>
std::vector<Value> spread(const std::vector<Value>& all, size_t most) {
  if (all.size() <= most) return all;
  std::vector<Value> some;
  for (size_t i = 1; i <= most; ++i) some.push_back(all[i * all.size() / most - 1]);
  return some;
}

void readSomePictures(Database& database, const std::vector<int64_t>& numbers, StoreGlance& glance) {
  for (const int64_t number : numbers) {
    if (auto whole = checkMessage(database, number); !whole)
      glance.damage.push_back("keyframe " + std::to_string(number) + ": " + whole.error().text);
    ++glance.pictures_read;
  }
}

void readSomeTiles(Database& database, size_t most, StoreGlance& glance) {
  std::vector<int64_t> numbers;
  // By an index of its own: the rows hold the surfels.
  eachRow(database, "tiles", "SELECT number FROM main.tiles INDEXED BY sqlite_autoindex_tiles_1", glance.damage,
          [&](Query& row) { numbers.push_back(row.integer()); });
  glance.tiles = numbers.size();
  const auto rows = database.integer("SELECT count(*) FROM main.tiles NOT INDEXED");
  if (!rows || *rows != static_cast<int64_t>(numbers.size()))
    glance.damage.push_back(rows ? "tiles: there are " + std::to_string(*rows) + ", and their index tells of " +
                                       std::to_string(numbers.size())
                                 : "tiles: " + rows.error().text);
  std::sort(numbers.begin(), numbers.end());
  for (const int64_t number : spread(numbers, most)) {
    auto query = database.query("SELECT surfels, zstd, " COMAP_IS_SOUND(COMAP_TILE_ROW) " FROM tiles WHERE number = ?");
    const auto row = query ? query->bind(number).step() : Result<bool>(query.error());
    Result<void> whole;
    if (!row) {
      whole = row.error();
    } else if (*row) {
      const int64_t count = query->integer();
      if (const auto surfels = decompressSurfels(query->bytes(), count); !surfels) whole = surfels.error();
      if (query->integer() != 1) whole = Error{ErrorCode::kBadData, kUnsound};
    } else {
      whole = Error{ErrorCode::kBadData, "its index tells of it, and it is not there"};
    }
    if (!whole) glance.damage.push_back("tile " + std::to_string(number) + ": " + whole.error().text);
    ++glance.tiles_read;
  }
}

Result<void> glanceAt(Database& database, size_t most_read, StoreGlance& glance) {
  const std::string& path = glance.path;
  std::error_code code;
  glance.bytes = std::filesystem::file_size(path, code);
  const auto ours = checkSchema(database);
  if (!ours) return ours.error();
  if (!*ours) return Error{ErrorCode::kBadData, path + ": is empty, no map store"};
  if (const std::string cut_off = cutOffText(path); !cut_off.empty()) glance.damage.push_back(cut_off);
  for (std::string& text : headDamage(path)) glance.damage.push_back(std::move(text));
  tellDeclarations(database, glance.damage);
  tellLogEnd(path, glance.damage, glance.remarks);
  remarkCompactDue(database, glance.remarks);
  auto large = std::async(std::launch::async, checkLargeTables, path);
  checkSmallTables(database, glance.damage);
  checkSums(database, glance.damage);
  KeyframeRuns known;
  std::vector<int64_t> numbers;
  lookAtKeyframes(database, glance, known, numbers);
  glance.edges = lookAtEnds(database, "edges",
                            "SELECT from_robot, from_session, from_sequence, to_robot, to_session, to_sequence "
                            "FROM main.edges INDEXED BY sqlite_autoindex_edges_1",
                            known, glance);
  glance.verdicts = lookAtEnds(database, "verdicts",
                               "SELECT query_robot, query_session, query_sequence, candidate_robot, "
                               "candidate_session, candidate_sequence FROM verdicts",
                               known, glance);
  const auto merges = database.integer("SELECT count(*) FROM merges");
  if (merges) glance.merges = static_cast<size_t>(*merges);
  readSomePictures(database, spread(numbers, most_read), glance);
  readSomeTiles(database, most_read, glance);
  const auto unsound = large.get();
  glance.damage.insert(glance.damage.end(), unsound.begin(), unsound.end());
  return {};
}

}  // namespace

Result<StoreGlance> glanceAtStore(const std::string& path, size_t most_read) {
  StoreGlance glance;
  const auto done = atOneMoment(path, [&](Database& database) {
    glance = {};
    glance.path = path;
    return glanceAt(database, most_read, glance);
  });
  if (!done) return done.error();
  return glance;
}

}  // namespace comap
