#include "mapping_core/store/small_tables.h"

#include "mapping_core/store/survey_rows.h"

namespace comap {
namespace {

constexpr size_t kTold = 20;  // of one table

}  // namespace

void checkSmallTables(Database& database, std::vector<std::string>& damage) {
  for (const char* sql :
       {"PRAGMA main.quick_check(meta)", "PRAGMA main.quick_check(robots)", "PRAGMA main.quick_check(keyframes)",
        "PRAGMA main.quick_check(poses)", "PRAGMA main.quick_check(merges)", "PRAGMA main.quick_check(merge_robots)",
        "PRAGMA main.quick_check(merge_voters)"}) {
    auto query = database.query(sql);
    if (!query) {
      damage.push_back(query.error().text);
      continue;
    }
    for (size_t told = 0; told < kTold; ++told) {
      const auto row = query->step();
      if (!row) damage.push_back(std::string(sql) + " ends early: " + row.error().text);
      if (!row || !*row) break;
      const std::string text = query->text();
      if (text != "ok") addLines("SQLite: ", text, damage);
    }
  }
}

}  // namespace comap
