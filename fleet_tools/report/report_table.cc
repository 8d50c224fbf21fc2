#include "fleet_tools/report/report_table.h"

#include <algorithm>

#include "fleet_tools/command_line/text_table.h"
#include "fleet_tools/report/html.h"

namespace comap {

using nlohmann::json;

namespace {

std::string columnText(const json& row, const Column& column) {
  const json* at = &row;
  for (const std::string& key : column.path) at = at == nullptr ? nullptr : valueAt(*at, {key.c_str()});
  if (column.count && at != nullptr && at->is_array()) return std::to_string(at->size());
  return cellText(at, column.scale, column.decimals);
}

bool looksNumeric(const std::string& text) { return text.find_first_not_of("0123456789.-+e") == std::string::npos; }

}  // namespace

const json* valueAt(const json& from, std::initializer_list<const char*> path) {
  const json* at = &from;
  for (const char* key : path) {
    if (!at->is_object()) return nullptr;
    const auto found = at->find(key);
    if (found == at->end() || found->is_null()) return nullptr;
    at = &*found;
  }
  return at;
}

std::string cellText(const json* value, double scale, int decimals) {
  if (value == nullptr || value->is_null()) return "";
  if (value->is_string()) return htmlEscape(value->get<std::string>());
  if (value->is_boolean()) return value->get<bool>() ? "yes" : "no";
  if (value->is_number() && (decimals >= 0 || value->is_number_float())) {
    return fixed(scale * value->get<double>(), decimals >= 0 ? decimals : 4);
  }
  if (value->is_number()) return value->dump();
  if (value->is_array()) {
    std::string text;
    for (const json& item : *value) text += (text.empty() ? "" : ", ") + cellText(&item);
    return text;
  }
  return "";
}

std::string htmlTable(const std::vector<Column>& columns, const std::vector<json>& rows) {
  if (rows.empty()) return "";
  std::vector<std::vector<std::string>> texts;
  std::vector<bool> used(columns.size(), false), numeric(columns.size(), true);
  for (const json& row : rows) {
    std::vector<std::string>& line = texts.emplace_back();
    for (size_t c = 0; c < columns.size(); ++c) {
      line.push_back(columnText(row, columns[c]));
      used[c] = used[c] || !line.back().empty();
      numeric[c] = numeric[c] && looksNumeric(line.back());
    }
  }
  if (std::none_of(used.begin(), used.end(), [](bool any) { return any; })) return "";
  std::string html = "<section class=\"box\"><table><thead><tr>";
  for (size_t c = 0; c < columns.size(); ++c) {
    if (used[c]) html += (numeric[c] ? "<th class=\"n\">" : "<th>") + columns[c].title + "</th>";
  }
  html += "</tr></thead><tbody>";
  for (const auto& line : texts) {
    html += "<tr>";
    for (size_t c = 0; c < columns.size(); ++c) {
      if (used[c]) html += (numeric[c] ? "<td class=\"n\">" : "<td class=\"w\">") + line[c] + "</td>";
    }
    html += "</tr>";
  }
  return html + "</tbody></table></section>\n";
}

std::vector<json> robotRows(const json& report) {
  std::vector<json> rows;
  const json* robots = valueAt(report, {"robots"});
  if (robots == nullptr || !robots->is_object()) return rows;
  for (const auto& [name, values] : robots->items()) {
    if (!values.is_object()) continue;
    json row = values;
    row["name"] = name;
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<json> arrayRows(const json& report, const char* key) {
  const json* list = valueAt(report, {key});
  if (list == nullptr || !list->is_array()) return {};
  return {list->begin(), list->end()};
}

}  // namespace comap
