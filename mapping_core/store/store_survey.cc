#include "mapping_core/store/store_survey.h"

#include <array>
#include <future>

#include "mapping_core/store/keyframe_runs.h"
#include "mapping_core/store/record_rows.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/survey_indexes.h"
#include "mapping_core/store/survey_keyframes.h"
#include "mapping_core/store/survey_rows.h"
#include "mapping_core/store/tile_bytes.h"
#include "protocol/storage/database.h"

namespace comap {
namespace {

constexpr int kTold = 20;  // of what SQLite finds

Error damagedRow(const std::string& text) { return {ErrorCode::kBadData, text}; }
Error mistyped() { return damagedRow("a value of it is of another type than its column"); }

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
  auto query = database.query("SELECT key, value FROM meta");
  Result<bool> row = query ? query->step() : Result<bool>(query.error());
  for (; row && *row; row = query->step()) {
    const std::string key = query->text();
    survey.meta[key] = query->text();
  }
  if (!row) survey.damage.push_back("the settings of the store: " + row.error().text);
}

// Keyframes by their place in survey.keyframes.
Result<std::array<uint32_t, 2>> placesOf(const KeyframeRuns& whole, const KeyframeId& a, const KeyframeId& b) {
  std::array<uint32_t, 2> places{};
  for (size_t end = 0; end < 2; ++end) {
    const KeyframeId& id = end == 0 ? a : b;
    const auto place = whole.groupOf(id);
    if (!place) return damagedRow("names keyframe " + toString(id) + ", which is not there or not whole");
    places[end] = *place;
  }
  return places;
}

void readEdges(Database& database, const KeyframeRuns& whole, StoreSurvey& survey, IndexEntries& entries) {
  const auto check = [&](int64_t number, Query& row) -> Result<void> {
    if (!row.areOf(COMAP_EDGE_TYPES)) return mistyped();
    const auto edge = edgeOf(row, database.path());
    if (!edge) return edge.error();
    if (!edge->edge.information.allFinite() || !edge->edge.T_from_to.translation().allFinite())
      return damagedRow("a number of it is none");
    const auto places = placesOf(whole, edge->edge.from, edge->edge.to);
    if (!places) return places.error();
    if (auto values = row.values(); !values) return values;
    for (const uint32_t place : *places) survey.keyframes[place].has_edge = true;
    if (edge->edge.kind == EdgeKind::kOdometry) survey.keyframes[(*places)[1]].tied = true;
    const std::string kind = kindName(edge->edge.kind);
    const int64_t merge = edge->edge.merge, withdrawn_by = edge->withdrawn_by;
    entries.edges.add(EntryHash().add(kind).add(edge->edge.from).add(edge->edge.to).add(number));
    if (withdrawn_by != 0) entries.withdrawn_edges.add(EntryHash().add(withdrawn_by).add(kind).add(number));
    if (merge != 0) entries.edges_of_merges.add(EntryHash().add(merge).add(number));
    return {};
  };
  surveyTable(database, "edge", COMAP_TABLE_ROWS("edges", "number", COMAP_EDGE_COLUMNS), check, survey.damage,
              survey.edges);
}

void readVerdicts(Database& database, const KeyframeRuns& whole, StoreSurvey& survey, IndexEntries& entries) {
  const auto check = [&](int64_t number, Query& row) -> Result<void> {
    if (!row.areOf(COMAP_VERDICT_TYPES)) return mistyped();
    const MatchVerdict verdict = verdictOf(row);
    if (auto places = placesOf(whole, verdict.query, verdict.candidate); !places) return places.error();
    if (auto values = row.values(); !values) return values;
    entries.verdicts.add(EntryHash().add(int64_t{verdict.accepted}).add(verdict.reason).add(number));
    return {};
  };
  surveyTable(database, "verdict", COMAP_TABLE_ROWS("verdicts", "number", COMAP_VERDICT_COLUMNS), check, survey.damage,
              survey.verdicts);
}

void readMerges(Database& database, StoreSurvey& survey) {
  const auto check = [&](int64_t, Query& row) -> Result<void> {
    MergeRecord merge = mergeOf(row);
    (void)row.unsigned32();  // with whose undoing it went: a number like others
    if (auto values = row.values(); !values) return values;
    if (auto lists = readMergeLists(database, merge); !lists) return lists;
    if (!merge.T_kept_absorbed.translation().allFinite()) return damagedRow("a number of it is none");
    if (merge.kept.empty() || merge.absorbed.empty()) return damagedRow("names no map");
    survey.merges.push_back(std::move(merge));
    return {};
  };
  surveyTable(database, "merge", COMAP_TABLE_ROWS("merges", "number", COMAP_MERGE_COLUMNS ", undone_by"), check,
              survey.damage, survey.merge_rows);
}

void readTiles(Database& database, StoreSurvey& survey) {
  const auto check = [&](int64_t, Query& row) -> Result<void> {
    const int64_t count = row.integer();
    if (const auto surfels = decompressSurfels(row.bytes(), count); !surfels) return surfels.error();
    if (auto values = row.values(); !values) return values;
    ++survey.tiles;
    return {};
  };
  KeptRows kept;
  surveyTable(database, "tile", COMAP_TABLE_ROWS("tiles", "number", "surfels, zstd"), check, survey.damage, kept);
}

// Of tables that are whole: of others, rows are copied one by one, and their indexes made anew.
void compareIndexes(Database& database, const IndexEntries& entries, StoreSurvey& survey) {
  const auto compare = [&](const char* what, bool rows_whole, bool (*whole)(Database&, const IndexEntries&)) {
    if (!rows_whole) return false;
    if (whole(database, entries)) return true;
    survey.damage.push_back(std::string("an index of the ") + what + " does not say what they say");
    return false;
  };
  survey.keyframe_indexes_whole = compare("keyframes", survey.descriptions.all(), areKeyframeIndexesWhole);
  survey.edge_indexes_whole = compare("edges", survey.edges.all(), areEdgeIndexesWhole);
  survey.verdict_indexes_whole = compare("verdicts", survey.verdicts.all(), areVerdictIndexesWhole);
}

Result<void> surveyTables(Database& database, StoreSurvey& survey, SurveyDepth depth,
                          const std::function<void(size_t, size_t)>& progress) {
  const std::string& path = survey.path;
  const auto ours = checkSchema(database);
  if (!ours) return ours.error();
  if (!*ours) return Error{ErrorCode::kBadData, path + ": is empty, no map store"};
  if (const std::string cut_off = cutOffText(path); !cut_off.empty()) survey.damage.push_back(cut_off);
  std::future<std::vector<std::string>> pages;
  if (depth == SurveyDepth::kPages) pages = std::async(std::launch::async, checkPages, path);
  const size_t before_rows = survey.damage.size();
  readMeta(database, survey);
  remarkCompactDue(database, survey.remarks);
  IndexEntries entries;
  surveyKeyframes(database, survey, entries, progress);
  KeyframeRuns whole;
  for (size_t i = 0; i < survey.keyframes.size(); ++i)
    whole.add(survey.keyframes[i].stored.id, static_cast<uint32_t>(i));
  readEdges(database, whole, survey, entries);
  readVerdicts(database, whole, survey, entries);
  readMerges(database, survey);
  readTiles(database, survey);
  if (depth == SurveyDepth::kRows) {
    compareIndexes(database, entries, survey);
    return {};
  }
  const std::vector<std::string> of_pages = pages.get();
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
