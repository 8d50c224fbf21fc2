#include "mapping_core/store/store_survey.h"

#include <algorithm>
#include <filesystem>

#include "mapping_core/store/keyframe_runs.h"
#include "mapping_core/store/record_rows.h"
#include "mapping_core/store/schema.h"
#include "mapping_core/store/survey_keyframes.h"
#include "mapping_core/store/survey_rows.h"
#include "mapping_core/store/tile_bytes.h"
#include "protocol/storage/database.h"

namespace comap {
namespace {

constexpr int kTold = 20;  // of what SQLite finds

Error damagedRow(const std::string& text) { return {ErrorCode::kBadData, text}; }

void checkPages(Database& database, std::vector<std::string>& damage) {
  auto query = database.query("PRAGMA integrity_check(20)");
  if (!query) return damage.push_back(query.error().text);
  for (int told = 0; told <= kTold; ++told) {
    const auto row = query->step();
    if (!row) return damage.push_back("SQLite's own check ends early: " + row.error().text);
    if (!*row) return;
    const std::string text = query->text();
    if (text != "ok") addLines("SQLite: ", text, damage);
  }
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

Result<void> checkEnds(const KeyframeRuns& whole, const KeyframeId& a, const KeyframeId& b) {
  for (const KeyframeId& end : {a, b})
    if (!whole.contains(end))
      return damagedRow("names keyframe " + toString(end) + ", which is not there or not whole");
  return {};
}

void readEdges(Database& database, const KeyframeRuns& whole, StoreSurvey& survey) {
  const auto check = [&](Query& row) -> Result<void> {
    auto edge = edgeOf(row, database.path());
    if (!edge) return edge.error();
    if (!edge->edge.information.allFinite() || !edge->edge.T_from_to.translation().allFinite())
      return damagedRow("a number of it is none");
    if (auto ends = checkEnds(whole, edge->edge.from, edge->edge.to); !ends) return ends;
    if (auto values = row.values(); !values) return values;
    survey.edges.push_back(std::move(*edge));
    return {};
  };
  surveyTable(database, "edge", COMAP_TABLE_ROWS("edges", "number", COMAP_EDGE_COLUMNS), check, survey.damage);
}

void readVerdicts(Database& database, const KeyframeRuns& whole, StoreSurvey& survey) {
  const auto check = [&](Query& row) -> Result<void> {
    MatchVerdict verdict = verdictOf(row);
    if (auto ends = checkEnds(whole, verdict.query, verdict.candidate); !ends) return ends;
    if (auto values = row.values(); !values) return values;
    survey.verdicts.push_back(std::move(verdict));
    return {};
  };
  surveyTable(database, "verdict", COMAP_TABLE_ROWS("verdicts", "number", COMAP_VERDICT_COLUMNS), check, survey.damage);
}

void readMerges(Database& database, StoreSurvey& survey) {
  const auto check = [&](Query& row) -> Result<void> {
    MergeRecord merge = mergeOf(row);
    const uint32_t undone_by = row.unsigned32();
    if (auto values = row.values(); !values) return values;
    if (auto lists = readMergeLists(database, merge); !lists) return lists;
    if (!merge.T_kept_absorbed.translation().allFinite()) return damagedRow("a number of it is none");
    if (merge.kept.empty() || merge.absorbed.empty()) return damagedRow("names no map");
    if (!merge.undone.empty()) survey.undone_by[merge.number] = undone_by;
    survey.merges.push_back(std::move(merge));
    return {};
  };
  surveyTable(database, "merge", COMAP_TABLE_ROWS("merges", "number", COMAP_MERGE_COLUMNS ", undone_by"), check,
              survey.damage);
}

void readTiles(Database& database, StoreSurvey& survey) {
  const auto check = [&](Query& row) -> Result<void> {
    const int64_t count = row.integer();
    if (const auto surfels = decompressSurfels(row.bytes(), count); !surfels) return surfels.error();
    if (auto values = row.values(); !values) return values;
    ++survey.tiles;
    return {};
  };
  surveyTable(database, "tile", COMAP_TABLE_ROWS("tiles", "number", "surfels, zstd"), check, survey.damage);
}

}  // namespace

Result<StoreSurvey> surveyStore(const std::string& path, const std::function<void(size_t, size_t)>& progress) {
  StoreSurvey survey;
  survey.path = path;
  auto database = openDamaged(path, &survey.damage);
  if (!database) return database.error();
  const auto ours = checkSchema(*database);
  if (!ours) return ours.error();
  if (!*ours) return Error{ErrorCode::kBadData, path + ": is empty, no map store"};
  checkPages(*database, survey.damage);
  readMeta(*database, survey);
  surveyKeyframes(*database, survey, progress);
  KeyframeRuns whole;
  for (const StoredKeyframe& keyframe : survey.keyframes) whole.add(keyframe.id);
  readEdges(*database, whole, survey);
  readVerdicts(*database, whole, survey);
  readMerges(*database, survey);
  readTiles(*database, survey);
  return survey;
}

}  // namespace comap
