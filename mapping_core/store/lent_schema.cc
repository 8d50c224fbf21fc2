#include "mapping_core/store/lent_schema.h"

#include <filesystem>
#include <utility>
#include <vector>

#include "mapping_core/store/map_store.h"
#include "mapping_core/store/schema.h"
#include "protocol/storage/first_page.h"

namespace comap {
namespace {

using Page = std::vector<char>;

struct Layout {
  const char* set_page_size;
  bool written_anew;  // by VACUUM, which makes indexes after all tables
};

constexpr Layout kLayouts[] = {{kSetPageSize, false},
                               {kSetPageSize, true},
                               {"PRAGMA page_size = 4096", false},  // of earlier releases
                               {"PRAGMA page_size = 4096", true}};

Result<void> makeStore(const std::string& path, const Layout& layout) {
  {
    auto database = Database::open(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
    if (!database) return database.error();
    if (auto set = database->execute(layout.set_page_size); !set) return set;
    if (auto set = database->execute("PRAGMA journal_mode = WAL"); !set) return set;
  }
  auto store = MapStore::open(path, MapStore::Mode::kCreateOrOpen);
  if (!store) return store.error();
  return layout.written_anew ? store->compact() : Result<void>();
}

Page newFirstPage(const std::string& path, const Layout& layout) {
  const auto removeAll = [&] {
    std::error_code ignored;
    for (const char* part : {"", "-wal", "-shm"}) std::filesystem::remove(path + part, ignored);
  };
  removeAll();
  Page page;
  if (makeStore(path, layout)) page = firstPageOf(path);
  removeAll();
  return page;
}

size_t wholeRowsOf(const StoreSurvey& survey) {
  return survey.keyframes.size() + survey.edges.size() + survey.verdicts.size() + survey.merges.size();
}

}  // namespace

std::optional<StoreSurvey> surveyWithLentSchema(const std::string& copy,
                                                const std::function<void(size_t, size_t)>& progress) {
  if (const auto version = storeVersionOf(copy); version && *version != kStoreVersion) return std::nullopt;
  std::optional<StoreSurvey> best;
  Page best_start;
  for (const Layout& layout : kLayouts) {
    const Page lent = fitFirstPage(newFirstPage(copy + "-lent", layout), copy);
    const Page damaged = firstBytesOf(copy, lent.size());
    if (lent.empty() || !overwriteStart(copy, lent)) continue;
    auto survey = surveyStore(copy, progress, SurveyDepth::kRows);
    overwriteStart(copy, damaged);  // pages of the next layout may be smaller
    if (!survey || survey->keyframes.empty() || (best && wholeRowsOf(*survey) <= wholeRowsOf(*best))) continue;
    best = std::move(*survey);
    best_start = lent;
    if (best->damage.empty()) break;
  }
  if (!best || !overwriteStart(copy, best_start)) return std::nullopt;
  best->damage.insert(best->damage.begin(), "the file's first page: read with that of a new store in its place");
  return best;
}

}  // namespace comap
