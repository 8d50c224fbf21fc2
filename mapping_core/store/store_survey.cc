#include "mapping_core/store/store_survey.h"

#include <array>
#include <future>

#include "mapping_core/store/keyframe_places.h"
#include "mapping_core/store/packed_numbers.h"
#include "mapping_core/store/record_rows.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/small_tables.h"
#include "mapping_core/store/survey_indexes.h"
#include "mapping_core/store/survey_keyframes.h"
#include "mapping_core/store/survey_rows.h"
#include "mapping_core/store/tile_bytes.h"
#include "protocol/storage/database.h"
#include "protocol/storage/first_page.h"

namespace comap {
namespace {

constexpr int kTold = 20;    // of what SQLite finds
constexpr int kScores = 10;  // columns of a verdict that are numbers of its tests

Error damagedRow(const std::string& text) { return {ErrorCode::kBadData, text}; }

// On a connection of its own: it reads every page, and so do the others.
std::vector<std::string> checkPages(const std::string& path) {
  std::vector<std::string> damage;
  auto database = openDamaged(path);
  auto query = database ? database->query("PRAGMA integrity_check(20)") : Result<Query>(database.error());
  if (!query) return {query.error().text};
  for (int told = 0; told <= kTold; ++told) {
    const auto row = query->step();
    if (!row) damage.push_back("SQLite's own check ends early: " + row.error().text);
    if (!row || !*row) break;
    const std::string text = query->text();
    if (text != "ok") addLines("SQLite: ", text, damage);
  }
  return damage;
}

void readMeta(Database& database, StoreSurvey& survey) {
  auto query = database.query("SELECT key, value, " COMAP_IS_SOUND(COMAP_META_ROW) " FROM meta");
  Result<bool> row = query ? query->step() : Result<bool>(query.error());
  for (; row && *row; row = query->step()) {
    const std::string key = query->text(), value = query->text();
    if (query->integer() == 1)
      survey.meta[key] = value;
    else
      survey.damage.push_back("setting '" + key + "' of the store: " + kUnsound);
  }
  if (!row) survey.damage.push_back("the settings of the store: " + row.error().text);
}

// Of what they say nothing is kept: keyframes name their robots.
void readRobots(Database& database, StoreSurvey& survey) {
  const auto check = [](int64_t, Query& row) {
    return row.integer() == 1 ? Result<void>() : Result<void>(damagedRow(kUnsound));
  };
  KeptRows kept;
  surveyTable(database, "robot", COMAP_TABLE_ROWS("robots", "bit", COMAP_IS_SOUND(COMAP_ROBOT_ROW)), check,
              survey.damage, kept);
}

Result<std::array<uint32_t, 2>> placesOf(const KeyframePlaces& whole, const KeyframeId& a, const KeyframeId& b) {
  std::array<uint32_t, 2> places{};
  for (size_t end = 0; end < 2; ++end) {
    const KeyframeId& id = end == 0 ? a : b;
    const auto place = whole.placeOf(id);
    if (!place) return damagedRow("names keyframe " + toString(id) + ", which is not there or not whole");
    places[end] = *place;
  }
  return places;
}

void readEdges(Database& database, StoreSurvey& survey, IndexEntries& entries) {
  const KeyframePlaces whole(survey.keyframes);
  const auto check = [&](int64_t number, Query& row) -> Result<void> {
    if (auto sound = checkRow(row, COMAP_EDGE_TYPES); !sound) return sound;
    row.skip(1);  // its number
    const std::string_view kind = row.textView();
    const KeyframeId from = row.keyframeId(), to = row.keyframeId();
    std::string wrong;
    const auto numbers = unpackNumbers(row.bytes(), wrong);
    const int64_t merge = row.unsigned32(), withdrawn_by = row.unsigned32();
    const auto known = kindOf(std::string(kind), database.path());
    if (!known) return known.error();
    if (!numbers) return damagedRow(wrong);
    if (!numbers->pose.translation().allFinite() || !numbers->information.allFinite())
      return damagedRow("a number of it is none");
    const auto places = placesOf(whole, from, to);
    if (!places) return places.error();
    if (auto values = row.values(); !values) return values;
    for (const uint32_t place : *places) survey.keyframes[place].has_edge = true;
    if (*known == EdgeKind::kOdometry) survey.keyframes[(*places)[1]].tied = true;
    entries.edges.add(EntryHash().add(kind).add(from).add(to).add(number));
    addPartialEntries(entries, number, kind, merge, withdrawn_by);
    return {};
  };
  surveyTable(database, "edge", COMAP_TABLE_ROWS("edges", "number", COMAP_EDGE_COLUMNS), check, survey.damage,
              survey.edges);
}

// What is read of a store beside its edges.
struct BesideEdges {
  KeptRows verdicts;
  EntrySum verdict_entries;
  std::vector<std::string> damage;
  FoundIndexes indexes;
};

void readVerdicts(Database& database, const std::vector<WholeKeyframe>& keyframes, BesideEdges& found) {
  const KeyframePlaces whole(keyframes);
  const auto check = [&](int64_t number, Query& row) -> Result<void> {
    if (auto sound = checkRow(row, COMAP_VERDICT_TYPES); !sound) return sound;
    row.skip(1);  // its number
    const KeyframeId query = row.keyframeId(), candidate = row.keyframeId();
    const int64_t accepted = row.integer();
    const std::string_view reason = row.textView();
    row.skip(kScores);
    std::string wrong;
    const auto numbers = unpackNumbers(row.bytes(), wrong);
    if (!numbers) return damagedRow(wrong);
    if (auto places = placesOf(whole, query, candidate); !places) return places.error();
    if (auto values = row.values(); !values) return values;
    found.verdict_entries.add(EntryHash().add(int64_t{accepted != 0}).add(reason).add(number));
    return {};
  };
  surveyTable(database, "verdict", COMAP_TABLE_ROWS("verdicts", "number", COMAP_VERDICT_COLUMNS), check, found.damage,
              found.verdicts);
}

BesideEdges readBesideEdges(Database& database, const std::vector<WholeKeyframe>& keyframes, bool by_rows) {
  BesideEdges found;
  readVerdicts(database, keyframes, found);
  if (!by_rows) return found;
  checkSmallTables(database, found.damage);
  found.indexes = readIndexes(database);
  return found;
}

void readMerges(Database& database, StoreSurvey& survey) {
  const auto check = [&](int64_t, Query& row) -> Result<void> {
    const bool sound = row.integer() == 1;
    (void)row.unsigned32();  // with whose undoing it went: a number like others
    MergeRecord merge = mergeOf(row);
    if (!sound) return damagedRow(kUnsound);
    if (auto values = row.values(); !values) return values;
    if (auto lists = readMergeLists(database, merge); !lists) return lists;
    if (!merge.T_kept_absorbed.translation().allFinite()) return damagedRow("a number of it is none");
    if (merge.kept.empty() || merge.absorbed.empty()) return damagedRow("names no map");
    survey.merges.push_back(std::move(merge));
    return {};
  };
  surveyTable(database, "merge",
              COMAP_TABLE_ROWS("merges", "number", COMAP_IS_SOUND(COMAP_MERGE_ROW) ", undone_by, " COMAP_MERGE_COLUMNS),
              check, survey.damage, survey.merge_rows);
}

void readTiles(Database& database, StoreSurvey& survey) {
  const auto check = [&](int64_t, Query& row) -> Result<void> {
    const int64_t count = row.integer();
    if (const auto surfels = decompressSurfels(row.bytes(), count); !surfels) return surfels.error();
    if (row.integer() != 1) return damagedRow(kUnsound);
    if (auto values = row.values(); !values) return values;
    ++survey.tiles;
    return {};
  };
  KeptRows kept;
  surveyTable(database, "tile", COMAP_TABLE_ROWS("tiles", "number", "surfels, zstd, " COMAP_IS_SOUND(COMAP_TILE_ROW)),
              check, survey.damage, kept);
  // Rows that their page no longer counts are missed by their index alone, and the other way round.
  const auto entries = database.integer("SELECT count(*) FROM main.tiles INDEXED BY sqlite_autoindex_tiles_1");
  if (!entries)
    survey.damage.push_back("the index of the tiles: " + entries.error().text);
  else if (kept.all() && *entries != static_cast<int64_t>(kept.size()))
    survey.damage.push_back("tiles: " + std::to_string(kept.size()) + " can be read, and their index tells of " +
                            std::to_string(*entries));
}

// Of tables that are whole: of others, rows are copied one by one, and their indexes made anew.
void compareIndexes(const FoundIndexes& found, const IndexEntries& rows, StoreSurvey& survey) {
  const auto compare = [&](const char* what, bool rows_whole, bool same) {
    if (rows_whole && !same)
      survey.damage.push_back(std::string("an index of the ") + what + " does not say what they say");
    return rows_whole && same;
  };
  survey.keyframe_indexes_whole = compare("keyframes", survey.descriptions.all(), found.keyframes.says(rows.keyframes));
  survey.edge_indexes_whole =
      compare("edges", survey.edges.all(),
              found.edges.says(rows.edges) && found.withdrawn_edges.says(rows.withdrawn_edges) &&
                  found.edges_of_merges.says(rows.edges_of_merges));
  survey.verdict_indexes_whole = compare("verdicts", survey.verdicts.all(), found.verdicts.says(rows.verdicts));
}

// Keyframes first: edges and verdicts name them. Then edges, and beside them on a connection of its own, or after them,
// the rest.
Result<void> readRows(Database& database, StoreSurvey& survey, bool side_by_side,
                      const std::function<void(size_t, size_t)>& progress) {
  IndexEntries entries;
  surveyKeyframes(database, survey, entries, progress);
  auto second = side_by_side ? openDamaged(survey.path) : Result<Database>(Error());
  if (side_by_side && !second) return second.error();
  // Else SQLite locks the file for each statement. Nobody is kept from writing: nobody does.
  for (Database* one : {&database, side_by_side ? &*second : nullptr})
    if (side_by_side && !one->inTransaction())
      if (auto begun = one->execute("BEGIN"); !begun) return begun;
  auto beside = std::async(side_by_side ? std::launch::async : std::launch::deferred, [&] {
    return readBesideEdges(side_by_side ? *second : database, survey.keyframes, side_by_side);
  });
  readEdges(database, survey, entries);
  BesideEdges found = beside.get();
  survey.verdicts = std::move(found.verdicts);
  entries.verdicts = found.verdict_entries;
  survey.damage.insert(survey.damage.end(), found.damage.begin(), found.damage.end());
  readMerges(database, survey);
  readTiles(database, survey);
  if (side_by_side) compareIndexes(found.indexes, entries, survey);
  return {};
}

Result<void> surveyTables(Database& database, StoreSurvey& survey, SurveyDepth depth,
                          const std::function<void(size_t, size_t)>& progress) {
  const std::string& path = survey.path;
  const auto ours = checkSchema(database);
  if (!ours) return ours.error();
  if (!*ours) return Error{ErrorCode::kBadData, path + ": is empty, no map store"};
  if (const std::string cut_off = cutOffText(path); !cut_off.empty()) survey.damage.push_back(cut_off);
  for (std::string& text : headDamage(path)) survey.damage.push_back(std::move(text));
  tellDeclarations(database, survey.damage);
  tellLogEnd(path, survey.damage, survey.remarks);
  const bool pages = depth == SurveyDepth::kPages;
  std::future<std::vector<std::string>> page_check;
  if (pages) page_check = std::async(std::launch::async, checkPages, path);
  const size_t before_rows = survey.damage.size();
  readMeta(database, survey);
  readRobots(database, survey);
  remarkCompactDue(database, survey.remarks);
  if (auto read = readRows(database, survey, !pages, progress); !read || !pages) return read;
  const std::vector<std::string> of_pages = page_check.get();
  survey.keyframe_indexes_whole = survey.edge_indexes_whole = survey.verdict_indexes_whole = of_pages.empty();
  survey.damage.insert(survey.damage.begin() + static_cast<std::ptrdiff_t>(before_rows), of_pages.begin(),
                       of_pages.end());
  return {};
}

}  // namespace

Result<StoreSurvey> surveyStore(const std::string& path, const std::function<void(size_t, size_t)>& progress,
                                SurveyDepth depth) {
  StoreSurvey survey;
  const auto done = atOneMoment(path, [&](Database& database) -> Result<void> {
    survey = {};
    survey.path = path;
    return surveyTables(database, survey, depth, progress);
  });
  if (!done) return done.error();
  return survey;
}

}  // namespace comap
