// The first page of an outbox, which says where all else is, in place of one that is damaged. Inside the outbox only.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace comap {

/// That of a new outbox says the same, as its tables are made in one order. The damaged one is put back when this goes,
/// which must be after all that reads the file.
class LentFirstPage {
 public:
  /// Nothing if the file has no other pages, or cannot be read and written.
  static std::unique_ptr<LentFirstPage> lend(const std::string& path);
  ~LentFirstPage();
  LentFirstPage(const LentFirstPage&) = delete;
  LentFirstPage& operator=(const LentFirstPage&) = delete;

 private:
  using Page = std::vector<char>;
  LentFirstPage(std::string path, Page damaged, Page lent)
      : path_(std::move(path)), damaged_(std::move(damaged)), lent_(std::move(lent)) {}

  const std::string path_;
  const Page damaged_, lent_;
};

}  // namespace comap
