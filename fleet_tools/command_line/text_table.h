// Columns for people, and text from stores made fit for a terminal.
#pragma once

#include <string>
#include <vector>

namespace comap {

/// `text` with control characters and invalid UTF-8 replaced by '?': what a store holds may come from anywhere.
std::string printable(const std::string& text);

/// "1.5 MB": bytes in units of 1000.
std::string humanBytes(double bytes);

/// "1 merge", "2 merges".
std::string counted(size_t count, const std::string& noun);

/// A number with `decimals` digits, "-" if it is not finite.
std::string fixed(double value, int decimals);

/// Lines of aligned columns with two spaces between; columns whose cells are all numbers are aligned right.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> head) : rows_{std::move(head)} {}
  /// As many cells as the head has.
  void add(std::vector<std::string> cells);
  bool empty() const { return rows_.size() == 1; }
  std::string text() const;

 private:
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace comap
