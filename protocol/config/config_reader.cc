#include "protocol/config/config_reader.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <deque>
#include <fstream>
#include <map>
#include <sstream>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr size_t kMaxBytes = size_t{1} << 20;

struct Mistake {
  int line;  // from 1; 0 = none
  std::string text;
};

int lineOf(const YAML::Node& node) { return node.Mark().line + 1; }

std::string show(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

// The whole text as a number; "0x10", "1e3" for an integer, and "1.5m" are none.
template <class T>
bool parseNumber(const std::string& text, T& value) {
  const char* begin = text.data() + (text.starts_with('+') ? 1 : 0);
  const auto [end, code] = std::from_chars(begin, text.data() + text.size(), value);
  return code == std::errc() && end == text.data() + text.size();
}

}  // namespace

struct ConfigReader::Mapping {
  std::string path;                                          // "link." or empty
  std::map<std::string, std::pair<YAML::Node, int>> values;  // and the line of the key
  std::vector<std::string> known;
};

struct ConfigReader::Document {
  std::string name;
  std::deque<Mapping> mappings;  // a deque: readers point into it
  std::vector<Mistake> mistakes;

  void note(int line, const std::string& text) { mistakes.push_back({line, text}); }

  // Takes over the entries of a YAML mapping.
  Mapping* add(const std::string& path, const YAML::Node& node) {
    Mapping& mapping = mappings.emplace_back();
    mapping.path = path;
    if (!node.IsMap()) return &mapping;
    for (const auto& entry : node) {
      if (!entry.first.IsScalar()) {
        note(lineOf(entry.first), "a key of " + (path.empty() ? name : path) + " is no plain word");
        continue;
      }
      const std::string key = entry.first.Scalar();
      if (!mapping.values.try_emplace(key, entry.second, lineOf(entry.first)).second) {
        note(lineOf(entry.first), "key '" + path + key + "' stands there twice");
      }
    }
    return &mapping;
  }

  // The node of `key` if it is there; the key counts as known from now on.
  const YAML::Node* find(Mapping& mapping, const std::string& key) {
    if (std::find(mapping.known.begin(), mapping.known.end(), key) == mapping.known.end()) mapping.known.push_back(key);
    const auto found = mapping.values.find(key);
    return found == mapping.values.end() ? nullptr : &found->second.first;
  }

  // As find, for one that must be a scalar.
  const YAML::Node* findScalar(Mapping& mapping, const std::string& key, const std::string& expected) {
    const YAML::Node* node = find(mapping, key);
    if (node == nullptr || node->IsScalar()) return node;
    const char* found = node->IsNull() ? "empty" : node->IsMap() ? "a section" : "a list";
    note(mapping.values.at(key).second, mapping.path + key + ": is " + found + ", expected " + expected);
    return nullptr;
  }

  void refuse(const Mapping& mapping, const std::string& key, const YAML::Node& node, const std::string& expected) {
    note(lineOf(node), mapping.path + key + ": is '" + node.Scalar().substr(0, 100) + "', expected " + expected);
  }
};

ConfigReader::ConfigReader(std::shared_ptr<Document> document, Mapping* mapping)
    : document_(std::move(document)), mapping_(mapping) {}

Result<ConfigReader> ConfigReader::fromFile(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::ifstream file(path, std::ios::binary);
  std::string text(kMaxBytes + 1, '\0');
  if (!file || !file.read(text.data(), static_cast<std::streamsize>(text.size())).eof()) {
    if (file) return Error{ErrorCode::kWrongUse, path + ": over 1 MiB, which no configuration is"};
    return Error{ErrorCode::kUnreachable, path + ": cannot be read"};
  }
  text.resize(static_cast<size_t>(file.gcount()));
  return fromText(text, path);
}

Result<ConfigReader> ConfigReader::fromText(const std::string& text, const std::string& name) {
  if (text.size() > kMaxBytes) return Error{ErrorCode::kWrongUse, name + ": over 1 MiB, which no configuration is"};
  auto document = std::make_shared<Document>();
  document->name = name;
  YAML::Node root;
  try {
    root = YAML::Load(text);
  } catch (const YAML::Exception& error) {
    return Error{ErrorCode::kWrongUse, name + ":" + std::to_string(error.mark.line + 1) + ": no YAML: " + error.msg};
  }
  if (!root.IsMap() && !root.IsNull()) {
    return Error{ErrorCode::kWrongUse, name + ":" + std::to_string(lineOf(root)) + ": expected 'key: value' lines"};
  }
  Mapping* mapping = document->add("", root);
  return ConfigReader(std::move(document), mapping);
}

void ConfigReader::read(const std::string& key, double& value, double low, double high) {
  std::string expected = "a number";
  if (low > std::numeric_limits<double>::lowest()) expected += " from " + show(low);
  if (high < std::numeric_limits<double>::max()) expected += " up to " + show(high);
  const YAML::Node* node = document_->findScalar(*mapping_, key, expected);
  if (node == nullptr) return;
  double parsed = 0;
  if (node->Tag() == "!" || !parseNumber(node->Scalar(), parsed) || !std::isfinite(parsed) || parsed < low ||
      parsed > high) {
    return document_->refuse(*mapping_, key, *node, expected);
  }
  value = parsed;
}

void ConfigReader::read(const std::string& key, float& value, double low, double high) {
  double wide = value;
  read(key, wide, low, high);
  value = static_cast<float>(wide);
}

void ConfigReader::readInteger(const std::string& key, int64_t low, int64_t high, int64_t& value) {
  const std::string expected = "a whole number from " + std::to_string(low) + " to " + std::to_string(high);
  const YAML::Node* node = document_->findScalar(*mapping_, key, expected);
  if (node == nullptr) return;
  int64_t parsed = 0;
  if (node->Tag() == "!" || !parseNumber(node->Scalar(), parsed) || parsed < low || parsed > high) {
    return document_->refuse(*mapping_, key, *node, expected);
  }
  value = parsed;
}

void ConfigReader::read(const std::string& key, int& value, int64_t low, int64_t high) {
  int64_t wide = value;
  readInteger(key, std::max<int64_t>(low, std::numeric_limits<int>::min()),
              std::min<int64_t>(high, std::numeric_limits<int>::max()), wide);
  value = static_cast<int>(wide);
}

void ConfigReader::read(const std::string& key, uint32_t& value, int64_t low, int64_t high) {
  int64_t wide = value;
  readInteger(key, std::max<int64_t>(low, 0), std::min<int64_t>(high, std::numeric_limits<uint32_t>::max()), wide);
  value = static_cast<uint32_t>(wide);
}

void ConfigReader::read(const std::string& key, int64_t& value, int64_t low, int64_t high) {
  readInteger(key, low, high, value);
}

void ConfigReader::read(const std::string& key, bool& value) {
  const YAML::Node* node = document_->findScalar(*mapping_, key, "true or false");
  if (node == nullptr) return;
  const std::string& text = node->Scalar();
  if (node->Tag() == "!" || (text != "true" && text != "false")) {
    return document_->refuse(*mapping_, key, *node, "true or false");
  }
  value = text == "true";
}

void ConfigReader::read(const std::string& key, std::string& value) {
  if (const YAML::Node* node = document_->findScalar(*mapping_, key, "text"); node != nullptr) value = node->Scalar();
}

void ConfigReader::read(const std::string& key, std::string& value, const std::vector<std::string>& allowed) {
  std::string expected = "one of";
  for (const std::string& word : allowed) expected += (&word == &allowed.front() ? " " : ", ") + word;
  const YAML::Node* node = document_->findScalar(*mapping_, key, expected);
  if (node == nullptr) return;
  if (std::find(allowed.begin(), allowed.end(), node->Scalar()) == allowed.end()) {
    return document_->refuse(*mapping_, key, *node, expected);
  }
  value = node->Scalar();
}

ConfigReader ConfigReader::section(const std::string& key) {
  const YAML::Node* node = document_->find(*mapping_, key);
  const std::string path = mapping_->path + key;
  if (node != nullptr && !node->IsMap() && !node->IsNull()) {
    document_->note(mapping_->values.at(key).second, path + ": is no section, expected 'key: value' lines under it");
  }
  return ConfigReader(document_, document_->add(path + ".", node == nullptr ? YAML::Node() : *node));
}

bool ConfigReader::has(const std::string& key) const { return mapping_->values.contains(key); }

void ConfigReader::complain(const std::string& key, const std::string& what) {
  const auto found = mapping_->values.find(key);
  document_->note(found == mapping_->values.end() ? 0 : found->second.second, mapping_->path + key + ": " + what);
}

Result<void> ConfigReader::finish() const {
  std::vector<Mistake> mistakes = document_->mistakes;
  for (const Mapping& mapping : document_->mappings) {
    std::string known;
    auto names = mapping.known;
    std::sort(names.begin(), names.end());
    for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
    for (const auto& [key, value] : mapping.values) {
      if (std::binary_search(names.begin(), names.end(), key)) continue;
      mistakes.push_back({value.second, "unknown key '" + mapping.path + key.substr(0, 100) + "'; known: " + known});
    }
  }
  if (mistakes.empty()) return {};
  std::stable_sort(mistakes.begin(), mistakes.end(),
                   [](const Mistake& a, const Mistake& b) { return a.line < b.line; });
  std::string text;
  for (const Mistake& mistake : mistakes) {
    if (!text.empty()) text += "; ";
    text += document_->name;
    if (mistake.line > 0) text.append(":").append(std::to_string(mistake.line));
    text.append(": ").append(mistake.text);
  }
  return Error{ErrorCode::kWrongUse, text};
}

}  // namespace comap
