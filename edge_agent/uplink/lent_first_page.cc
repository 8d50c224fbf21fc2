#include "edge_agent/uplink/lent_first_page.h"

#include <filesystem>

#include "edge_agent/uplink/outbox.h"
#include "protocol/storage/first_page.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

using Page = std::vector<char>;

// Of an outbox that is made for this.
Page newFirstPage(const std::string& path) {
  const auto removeAll = [&] {
    std::error_code ignored;
    for (const char* part : {"", "-wal", "-shm"}) fs::remove(path + part, ignored);
  };
  removeAll();
  Page page;
  if (Outbox::open(path)) page = firstPageOf(path);
  removeAll();
  return page;
}

}  // namespace

std::unique_ptr<LentFirstPage> LentFirstPage::lend(const std::string& path) {
  Page lent = fitFirstPage(newFirstPage(path + ".first-page"), path);
  if (lent.empty()) return nullptr;
  Page damaged = firstBytesOf(path, lent.size());
  if (damaged.empty() || !overwriteStart(path, lent)) return nullptr;
  return std::unique_ptr<LentFirstPage>(new LentFirstPage(path, std::move(damaged), std::move(lent)));
}

LentFirstPage::~LentFirstPage() {
  // Unless its log held another one, which is the right one.
  if (firstBytesOf(path_, lent_.size()) == lent_) overwriteStart(path_, damaged_);
}

}  // namespace comap
