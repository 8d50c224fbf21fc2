#include "fleet_tools/command_line/text_table.h"

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <string_view>

namespace comap {
namespace {

// Bytes of the UTF-8 character at `at`, 0 if there is no valid one.
size_t characterLength(const std::string& text, size_t at) {
  const auto byte = [&](size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const unsigned first = byte(at);
  if (first < 0x80) return 1;
  const size_t length = first >= 0xc2 && first < 0xe0   ? 2
                        : first >= 0xe0 && first < 0xf0 ? 3
                        : first >= 0xf0 && first < 0xf5 ? 4
                                                        : 0;
  for (size_t i = 1; i < length; ++i) {
    if ((byte(at + i) & 0xc0) != 0x80) return 0;
  }
  const bool overlong = (first == 0xe0 && byte(at + 1) < 0xa0) || (first == 0xf0 && byte(at + 1) < 0x90);
  const bool beyond = (first == 0xed && byte(at + 1) >= 0xa0) || (first == 0xf4 && byte(at + 1) >= 0x90);
  return overlong || beyond ? 0 : length;
}

size_t width(std::string_view text) {
  return static_cast<size_t>(std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xc0) != 0x80; }));
}

bool isNumber(std::string_view cell) {
  return !cell.empty() && cell.find_first_not_of("0123456789.,-+e %kMGB") == std::string_view::npos;
}

// Most texts are: nothing in them is to be replaced.
bool isPlain(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c >= 0x20 && c < 0x7f; });
}

}  // namespace

std::string printable(const std::string& text) {
  std::string out;
  for (size_t at = 0; at < text.size();) {
    const size_t length = characterLength(text, at);
    const auto first = static_cast<unsigned char>(text[at]);
    const bool c1_control = length == 2 && first == 0xc2 && static_cast<unsigned char>(text[at + 1]) < 0xa0;
    if (length == 0 || c1_control || first < 0x20 || first == 0x7f) {
      out.push_back('?');
    } else {
      out.append(text, at, length);
    }
    at += std::max<size_t>(length, 1);
  }
  return out;
}

std::string listed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + printable(word);
  return text.empty() ? "none" : text;
}

std::string fixed(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  char text[64];  // to_chars: as printf, several times as fast
  const auto format = std::abs(value) < 1e15 ? std::chars_format::fixed : std::chars_format::scientific;
  const auto [end, code] = std::to_chars(text, text + sizeof text, value, format, decimals);
  return code == std::errc() ? std::string(text, end) : "-";
}

TextTable::TextTable(const std::vector<std::string>& head) : columns_(head.size()) {
  add(head);
  for (Column& column : columns_) column.numbers = true;
}

void TextTable::add(std::span<const std::string> cells) {
  assert(cells.size() == columns_.size());
  for (size_t c = 0; c < cells.size(); ++c) {
    const std::string& cell = cells[c];
    const size_t begin = text_.size();
    if (isPlain(cell))
      text_ += cell;
    else
      text_ += printable(cell);
    const std::string_view shown(text_.data() + begin, text_.size() - begin);
    cells_.push_back({text_.size(), width(shown)});
    columns_[c].width = std::max(columns_[c].width, cells_.back().width);
    columns_[c].numbers = columns_[c].numbers && isNumber(shown);
  }
}

std::string TextTable::text() const {
  std::string out;
  size_t line = 1;
  for (const Column& column : columns_) line += column.width + 2;
  out.reserve(line * (cells_.size() / columns_.size()));
  size_t begin = 0;
  for (size_t i = 0; i < cells_.size(); ++i) {
    const size_t c = i % columns_.size();
    const Cell& cell = cells_[i];
    const size_t padding = columns_[c].width - cell.width;
    if (c > 0) out.append(2, ' ');
    if (columns_[c].numbers) out.append(padding, ' ');
    out.append(text_, begin, cell.end - begin);
    if (!columns_[c].numbers) out.append(padding, ' ');
    begin = cell.end;
    if (c + 1 < columns_.size()) continue;
    out.erase(out.find_last_not_of(' ') + 1);
    out += '\n';
  }
  return out;
}

}  // namespace comap
