// Values of a report as text, and rows of them as an HTML table.
#pragma once

#include <initializer_list>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace comap {

/// What lies at the end of this path of keys; none if it is not there or null.
const nlohmann::json* valueAt(const nlohmann::json& from, std::initializer_list<const char*> path);

/// Escaped text of a value; numbers scaled and with so many decimals. Empty for null and for what has no one-line form.
std::string cellText(const nlohmann::json* value, double scale = 1, int decimals = -1);

struct Column {
  std::string title;
  std::vector<std::string> path;
  double scale = 1;
  int decimals = -1;
  bool count = false;  // of an array: how many
};

/// Columns that no row has are left out; empty if none is left.
std::string htmlTable(const std::vector<Column>& columns, const std::vector<nlohmann::json>& rows);

/// The robots of a report as rows that know their own name.
std::vector<nlohmann::json> robotRows(const nlohmann::json& report);

/// The elements of a list; none if it is none.
std::vector<nlohmann::json> arrayRows(const nlohmann::json& report, const char* key);

}  // namespace comap
