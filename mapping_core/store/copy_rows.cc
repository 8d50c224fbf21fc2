#include "mapping_core/store/copy_rows.h"

#include <filesystem>
#include <limits>

#include "mapping_core/store/schema.h"
#include "mapping_core/store/stray_messages.h"
#include "mapping_core/store/survey_keyframes.h"
#include "mapping_core/store/survey_rows.h"
#include "protocol/codec/message_checksum.h"

namespace comap {
namespace {

// A table, and how its rows are chosen by number.
struct Source {
  std::string table, number;
  std::string further;  // condition
  const KeptRows& kept;
  bool all = false;       // every row of the table is wanted
  bool prunable = false;  // of a copy of all that there is, the others can be taken out
};

// Columns by name: those of a damaged store may stand in another order.
Result<std::string> columnsOf(Database& to, const std::string& table) {
  const std::string sql = "SELECT group_concat(name, ', ') FROM pragma_table_info('" + table + "')";
  auto query = to.query(sql);
  if (!query) return query.error();
  const auto row = query->step();
  if (!row) return row.error();
  return query->text();
}

// Where the damaged store is of an older schema, its tables are looked at through views.
const std::string kOlder = "temp.damaged_";

Result<bool> hasView(Database& to, const std::string& table) {
  auto query = to.query("SELECT count(*) FROM temp.sqlite_schema WHERE name = ?");
  if (!query) return query.error();
  const auto row = query->bind("damaged_" + table).step();
  if (!row) return row.error();
  return query->integer() > 0;
}

Result<bool> declaredAlike(Database& to, const std::string& name) {
  auto query =
      to.query("SELECT count(*) FROM main.sqlite_schema JOIN damaged.sqlite_schema USING (name, sql) WHERE name = ?");
  if (!query) return query.error();
  const auto row = query->bind(name).step();
  if (!row) return row.error();
  return query->integer() == 1;
}

// Rows as they lie in the file, and their indexes: SQLite does so if both tables are declared with the same words and
// the new one is empty.
Result<bool> copyAll(Database& to, const Source& source) {
  const auto alike = declaredAlike(to, source.table);
  if (!alike || !*alike) return alike;
  return bool(to.execute("INSERT INTO main." + source.table + " SELECT * FROM damaged." + source.table));
}

// All of it or nothing: each statement is a transaction of its own. In a larger one SQLite would forbid all further
// writing once it has come upon damage.
Result<size_t> copySome(Database& to, const std::string& sql, std::initializer_list<int64_t> numbers) {
  auto query = to.query(sql);
  if (!query) return query.error();
  for (const int64_t number : numbers) query->bind(number);
  if (auto ran = query->run(); !ran) return ran.error();
  return static_cast<size_t>(to.changes());
}

// Where a tree is damaged, going along it finds less than asking for each number does, or the other way round.
Result<void> copyOneByOne(Database& to, const std::string& sql, const KeptRows::Run& run) {
  for (int64_t number = run.first; number <= run.last; ++number)
    if (auto copied = copySome(to, sql, {number}); !copied && copied.error().code != ErrorCode::kBadData)
      return copied.error();
  return {};
}

Result<void> copyTable(Database& to, const Source& source) {
  if (source.all) {
    const auto copied = copyAll(to, source);
    if (!copied || *copied) return copied ? Result<void>() : Result<void>(copied.error());
  }
  const auto columns = columnsOf(to, source.table);
  if (!columns) return columns.error();
  const auto older = hasView(to, source.table);
  if (!older) return older.error();
  const std::string from = (*older ? kOlder : "damaged.") + source.table;
  const std::string copy = "INSERT OR IGNORE INTO main." + source.table + " (" + *columns + ") SELECT " + *columns +
                           " FROM " + from + " WHERE " + source.number;
  const std::string many = copy + " BETWEEN ? AND ?" + source.further, one = copy + " = ?" + source.further;
  for (const KeptRows::Run& run : source.kept.runs()) {
    const auto copied = copySome(to, many, {run.first, run.last});
    if (copied && *copied >= run.count) continue;
    if (auto done = copyOneByOne(to, one, run); !done) return done;
  }
  return {};
}

Result<void> empty(Database& to, std::initializer_list<const char*> tables) {
  for (const char* table : tables)
    if (auto emptied = to.execute(std::string("DELETE FROM main.") + table); !emptied) return emptied;
  return {};
}

// Of a table that was copied unseen. Its indexes are made anew: the rows that go may not be what these say.
Result<void> prune(Database& to, const Source& source) {
  const std::string sql = "DELETE FROM main." + source.table + " WHERE " + source.number + " BETWEEN ? AND ?";
  int64_t next = std::numeric_limits<int64_t>::min();
  for (const KeptRows::Run& run : source.kept.runs()) {
    if (auto gone = copySome(to, sql, {next, run.first - 1}); !gone) return gone.error();
    next = run.last + 1;
  }
  if (auto gone = copySome(to, sql, {next, std::numeric_limits<int64_t>::max()}); !gone) return gone.error();
  return to.execute("REINDEX main." + source.table);
}

// Of a keyframe whose row is lost: what its message says.
Result<void> describe(Database& to, Database& from, const StoredKeyframe& keyframe) {
  const auto message = messageOf(from, keyframe.arrival);
  if (!message) return message.error();
  auto row = to.query(
      "INSERT INTO main.keyframes (arrival, robot, session, sequence, stamp_ns, bytes, crc32) "
      "VALUES (?, ?, ?, ?, ?, ?, ?)");
  if (!row) return row.error();
  row->bind(int64_t{keyframe.arrival}).bind(keyframe.id).bind(keyframe.stamp_ns);
  row->bind(static_cast<int64_t>(message->size()));
  return row->bind(int64_t{messageChecksum(*message)}).run();
}

// Together: what is wrong with one of the three tables changes what is wanted of the others.
bool areKeyframesWhole(const StoreSurvey& survey) {
  return survey.keyframe_indexes_whole && survey.messages.all() && survey.descriptions.all() && survey.poses.all();
}

bool pruneKeyframes(Database& to, const StoreSurvey& survey) {
  if (!survey.messages.inOrder() || !survey.descriptions.inOrder() || !survey.poses.inOrder()) return false;
  for (const Source& source :
       {Source{"keyframe_messages", "keyframe", "", survey.messages},
        Source{"keyframes", "arrival", "", survey.descriptions}, Source{"poses", "keyframe", "", survey.poses}})
    if (!prune(to, source)) return false;
  return bool(
      to.execute("DELETE FROM main.keyframes WHERE arrival NOT IN (SELECT keyframe FROM main.keyframe_messages)"));
}

Result<void> copyKeyframes(Database& to, const StoreSurvey& survey) {
  if (auto emptied = empty(to, {"poses", "keyframe_messages", "keyframes"}); !emptied) return emptied;
  const bool all = areKeyframesWhole(survey);
  const std::string there = " AND arrival IN (SELECT keyframe FROM main.keyframe_messages)";
  for (const Source& source : {Source{"keyframe_messages", "keyframe", "", survey.messages, all},
                               Source{"keyframes", "arrival", there, survey.descriptions, all},
                               Source{"poses", "keyframe", "", survey.poses, all}}) {
    if (auto copied = copyTable(to, source); !copied) return copied;
    if (source.table != "keyframe_messages") continue;
    if (auto copied = copyStrays(to, survey); !copied) return copied;  // the next table's condition sees them
  }
  return {};
}

Result<void> describeLost(Database& to, const StoreSurvey& survey) {
  auto from = openDamaged(survey.path);
  if (!from) return from.error();
  for (const WholeKeyframe& keyframe : survey.keyframes)
    if (!keyframe.described)
      if (auto described = describe(to, *from, keyframe.stored); !described) return described;
  return {};
}

// What follows from the keyframes that are there.
Result<void> fitKeyframes(Database& to) {
  for (const char* sql :
       {"DELETE FROM main.poses WHERE keyframe NOT IN (SELECT arrival FROM main.keyframes)", "DELETE FROM main.robots",
        "INSERT INTO main.robots (bit, name) SELECT row_number() OVER (ORDER BY min(arrival)) - 1, "
        "robot FROM main.keyframes GROUP BY robot"})
    if (auto done = to.execute(sql); !done) return done;
  return {};
}

// On a connection that may only read, SQLite copies row by row, in three times the time. On any other it writes nothing
// either, unless there is a log, which would be played back.
Result<Database> openToCopy(const std::string& path) {
  std::error_code none;
  const bool logged = std::filesystem::exists(path + "-wal", none) || std::filesystem::exists(path + "-journal", none);
  return Database::open(std::filesystem::absolute(path).string(),
                        logged ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE);
}

// Those for speed that the damaged store has as well: they are then copied with their table.
Result<void> makeSameIndexes(Database& to) {
  if (auto made = createIndexes(to); !made) return made;
  for (const char* name : indexNames()) {
    const auto alike = declaredAlike(to, name);
    if (!alike) return alike.error();
    if (*alike) continue;
    if (auto dropped = to.execute(std::string("DROP INDEX main.") + name); !dropped) return dropped;
  }
  return {};
}

Result<void> copyTables(Database& to, const StoreSurvey& survey, bool copied) {
  if (!copied || !(areKeyframesWhole(survey) || pruneKeyframes(to, survey)))
    if (auto done = copyKeyframes(to, survey); !done) return done;
  if (auto described = describeLost(to, survey); !described) return described;
  if (auto fitted = fitKeyframes(to); !fitted) return fitted;
  const KeptRows& merges = survey.merge_rows;
  for (const Source& source : {Source{"edges", "number", "", survey.edges,
                                      survey.edge_indexes_whole && survey.edges.all(), survey.edges.inOrder()},
                               Source{"verdicts", "number", "", survey.verdicts,
                                      survey.verdict_indexes_whole && survey.verdicts.all(), survey.verdicts.inOrder()},
                               Source{"merges", "number", "", merges}, Source{"merge_robots", "merge", "", merges},
                               Source{"merge_voters", "merge", "", merges}}) {
    if (copied && (source.all || (source.prunable && prune(to, source)))) continue;
    if (auto emptied = empty(to, {source.table.c_str()}); !emptied) return emptied;
    if (auto done = copyTable(to, source); !done) return done;
  }
  return empty(to, {"tiles", "meta"});
}

}  // namespace

bool copyUnseen(const std::string& damaged, const std::string& path) {
  std::error_code none;
  if (!std::filesystem::is_regular_file(damaged, none) || !cutOffText(damaged).empty()) return false;
  auto from = openToCopy(damaged);
  auto copy = from ? from->query("VACUUM INTO ?") : Result<Query>(from.error());
  if (copy && copy->bind(std::filesystem::absolute(path).string()).run()) {
    auto to = Database::open(std::filesystem::absolute(path).string(), SQLITE_OPEN_READONLY);
    // A damaged store may have tables, or rules for them, of its own.
    if (const auto ours = to ? isSchema(*to) : Result<bool>(to.error()); ours && *ours) return true;
  }
  std::filesystem::remove(path, none);
  return false;
}

Result<void> copyWholeRows(const StoreSurvey& survey, const std::string& path, bool copied) {
  auto to = Database::open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_URI);
  if (!to) return to.error();
  // Nobody has the file yet; it is synchronised when it is whole. The cache holds the indexes of 10^6 rows.
  for (const char* pragma :
       {kSetPageSize, "PRAGMA journal_mode = MEMORY", "PRAGMA synchronous = OFF", "PRAGMA cache_size = -262144"})
    if (auto set = to->execute(pragma); !set) return set;
  if (!copied)
    if (auto created = createSchema(*to); !created) return created;
  if (copied || !cutOffText(survey.path).empty()) to->bearDamage();
  if (auto attached = to->attachReading(survey.path, "damaged"); !attached) return attached;
  if (auto shown = showAsNewest(*to, "damaged", kOlder); !shown) return shown.error();
  if (!copied)
    if (auto made = makeSameIndexes(*to); !made) return made;
  return copyTables(*to, survey, copied);
}

}  // namespace comap
