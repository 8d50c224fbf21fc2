#include "mapping_core/store/schema_3.h"

#include <string>

#include "mapping_core/store/schema.h"
#include "mapping_core/store/table_rows.h"

namespace comap {
namespace {

#define COMAP_INFORMATION_OF_3                                                                 \
  "i00, i01, i02, i03, i04, i05, i10, i11, i12, i13, i14, i15, i20, i21, i22, i23, i24, i25, " \
  "i30, i31, i32, i33, i34, i35, i40, i41, i42, i43, i44, i45, i50, i51, i52, i53, i54, i55"
#define COMAP_NUMBERS_OF_3 "packed(" COMAP_POSE_COLUMNS ", " COMAP_INFORMATION_OF_3 ") AS numbers"

// A table that has changed: what of its rows a checksum is made of, as columns of 3; and what there is besides.
struct Table {
  const char* name;
  const char* rows;     // of schema 3, under the names of 4
  const char* summed;   // of schema 4
  const char* columns;  // of schema 4, all but the checksum
};

constexpr Table kTables[] = {
    {"meta", COMAP_META_ROW, COMAP_META_ROW, COMAP_META_ROW},
    {"robots", COMAP_ROBOT_ROW, COMAP_ROBOT_ROW, COMAP_ROBOT_ROW},
    {"keyframes", COMAP_KEYFRAME_ROW, COMAP_KEYFRAME_ROW, COMAP_KEYFRAME_ROW},
    {"poses", COMAP_POSE_ROW, COMAP_POSE_ROW, COMAP_POSE_ROW},
    {"edges", "number, " COMAP_TIE_COLUMNS ", " COMAP_NUMBERS_OF_3 ", merge, withdrawn_by", COMAP_EDGE_ROW,
     COMAP_EDGE_ROW},
    {"verdicts", "number, " COMAP_JUDGEMENT_COLUMNS ", " COMAP_SCORE_COLUMNS ", " COMAP_NUMBERS_OF_3, COMAP_VERDICT_ROW,
     COMAP_VERDICT_ROW},
    {"merges", COMAP_MERGE_ROW, COMAP_MERGE_ROW, COMAP_MERGE_ROW},
    {"merge_robots", COMAP_MERGE_ROBOT_ROW, COMAP_MERGE_ROBOT_ROW, COMAP_MERGE_ROBOT_ROW},
    {"merge_voters", COMAP_MERGE_VOTER_ROW, COMAP_MERGE_VOTER_ROW, COMAP_MERGE_VOTER_ROW},
    {"tiles", COMAP_TILE_ROW ", zstd", COMAP_TILE_ROW, COMAP_TILE_ROW ", zstd"},
};

std::string step() {
  std::string sql = "DROP INDEX verdicts_by_reason;\n";
  for (const Table& table : kTables) {
    const std::string name = table.name, columns = table.columns;
    sql += "ALTER TABLE " + name + " RENAME TO old_" + name + ";\n" + tableWords(name) + ";\n";
    sql += "INSERT INTO " + name + " (" + columns + ") SELECT " + table.rows + " FROM old_" + name + ";\n";
    sql += "DROP TABLE old_" + name + ";\n";
  }
  return sql + tableWords("verdicts_by_reason") + ";\n";
}

}  // namespace

const char* from3To4() {
  static const std::string kSql = step();
  return kSql.c_str();
}

Result<void> showAs4(Database& database, const std::string& schema, const std::string& prefix) {
  for (const Table& table : kTables) {
    const std::string name = table.name;
    const std::string sql = "CREATE TEMP VIEW " + prefix + name + " AS SELECT *, row_sum(" + table.summed +
                            ") AS checksum FROM (SELECT " + table.rows + " FROM " + schema + "." + name + ")";
    if (auto made = database.execute(sql); !made) return made;
  }
  return {};
}

}  // namespace comap
