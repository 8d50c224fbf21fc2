#include "edge_agent/uplink/lent_first_page.h"

#include <filesystem>
#include <fstream>

#include "edge_agent/uplink/outbox.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

constexpr size_t kPageSizeAt = 16, kPagesAt = 28, kHead = 100;

std::vector<char> firstBytes(const std::string& path, size_t bytes) {
  std::vector<char> page(bytes);
  std::ifstream file(path, std::ios::binary);
  file.read(page.data(), static_cast<std::streamsize>(bytes));
  if (!file) page.clear();
  return page;
}

bool overwrite(const std::string& path, const std::vector<char>& page) {
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.write(page.data(), static_cast<std::streamsize>(page.size()));
  return static_cast<bool>(file.flush());
}

// Of an outbox that is made for this.
std::vector<char> newFirstPage(const std::string& path) {
  const auto removeAll = [&] {
    std::error_code ignored;
    for (const char* part : {"", "-wal", "-shm"}) fs::remove(path + part, ignored);
  };
  removeAll();
  const bool made = Outbox::open(path) ? true : false;
  const std::vector<char> head = made ? firstBytes(path, kHead) : std::vector<char>();
  std::vector<char> page;
  if (!head.empty()) {
    const auto byteAt = [&](size_t at) { return static_cast<size_t>(static_cast<uint8_t>(head[at])); };
    page = firstBytes(path, byteAt(kPageSizeAt) << 8 | byteAt(kPageSizeAt + 1));
  }
  removeAll();
  return page;
}

}  // namespace

std::unique_ptr<LentFirstPage> LentFirstPage::lend(const std::string& path) {
  Page lent = newFirstPage(path + ".first-page");
  std::error_code code;
  const uintmax_t bytes = fs::file_size(path, code);
  if (code || lent.size() < kHead || bytes < 2 * lent.size()) return nullptr;
  const auto pages = static_cast<uint32_t>(bytes / lent.size());
  for (size_t i = 0; i < 4; ++i) lent[kPagesAt + i] = static_cast<char>(pages >> (24 - 8 * i));
  Page damaged = firstBytes(path, lent.size());
  if (damaged.empty() || !overwrite(path, lent)) return nullptr;
  return std::unique_ptr<LentFirstPage>(new LentFirstPage(path, std::move(damaged), std::move(lent)));
}

LentFirstPage::~LentFirstPage() {
  // Unless its log held another one, which is the right one.
  if (firstBytes(path_, lent_.size()) == lent_) overwrite(path_, damaged_);
}

}  // namespace comap
