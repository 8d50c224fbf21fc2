// Columns for people, and text from stores made fit for a terminal.
#pragma once

#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/counted.h"

namespace comap {

/// `text` with control characters and invalid UTF-8 replaced by '?': what a store holds may come from anywhere.
std::string printable(const std::string& text);

/// "a, b, c", each printable; "none" of none.
std::string listed(const std::vector<std::string>& words);

/// A number with `decimals` digits, "-" if it is not finite.
std::string fixed(double value, int decimals);

/// Lines of aligned columns with two spaces between; columns whose cells are all numbers are aligned right.
class TextTable {
 public:
  explicit TextTable(const std::vector<std::string>& head);
  /// As many cells as the head has.
  void add(std::span<const std::string> cells);
  void add(std::initializer_list<std::string> cells) { add(std::span(cells.begin(), cells.size())); }
  bool empty() const { return cells_.size() == columns_.size(); }
  std::string text() const;

 private:
  struct Column {
    size_t width = 0;  // characters
    bool numbers = true;
  };
  struct Cell {
    size_t end = 0;  // in text_, where the next one begins
    size_t width = 0;
  };
  std::vector<Column> columns_;
  std::string text_;  // all cells, one behind the other
  std::vector<Cell> cells_;
};

}  // namespace comap
