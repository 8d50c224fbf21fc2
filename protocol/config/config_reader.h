// Strict reading of a YAML mapping: typed values with ranges, nested sections, and every mistake told at once.
//
//   auto reader = ConfigReader::fromFile("robot.yaml");
//   if (!reader) return reader.error();
//   RobotConfig config;
//   reader->read("name", config.name);
//   ConfigReader link = reader->section("link");
//   link.read("domain", config.domain, 0, 230);
//   link.read("profile", config.profile, {"local", "lan", "wan"});
//   if (auto finished = reader->finish(); !finished) return finished.error();
//
// A key that is not there leaves its value as it was: the default. Readers share one list of mistakes.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

class ConfigReader {
 public:
  /// kUnreachable if the file cannot be read, kWrongUse if it is no YAML mapping, has a key twice, or is over 1 MiB.
  static Result<ConfigReader> fromFile(const std::string& path);
  /// The same for text; `name` stands for the file in errors.
  static Result<ConfigReader> fromText(const std::string& text, const std::string& name);

  /// Each sets `value` if the key is there with a value of its type and in its range (bounds included); else it notes
  /// the mistake. Numbers must be finite; whole numbers must be written as such.
  void read(const std::string& key, double& value, double low = std::numeric_limits<double>::lowest(),
            double high = std::numeric_limits<double>::max());
  void read(const std::string& key, float& value, double low = std::numeric_limits<float>::lowest(),
            double high = std::numeric_limits<float>::max());
  void read(const std::string& key, int& value, int64_t low = std::numeric_limits<int>::min(),
            int64_t high = std::numeric_limits<int>::max());
  void read(const std::string& key, uint32_t& value, int64_t low = 0,
            int64_t high = std::numeric_limits<uint32_t>::max());
  void read(const std::string& key, int64_t& value, int64_t low = std::numeric_limits<int64_t>::min(),
            int64_t high = std::numeric_limits<int64_t>::max());
  /// true or false, nothing else.
  void read(const std::string& key, bool& value);
  void read(const std::string& key, std::string& value);
  /// One of `allowed`.
  void read(const std::string& key, std::string& value, const std::vector<std::string>& allowed);

  /// The mapping under `key`; an empty one if it is not there.
  ConfigReader section(const std::string& key);

  bool has(const std::string& key) const;

  /// Notes a mistake of the caller's own at `key`, with its line: "robot.yaml:3: link.site: <what>".
  void complain(const std::string& key, const std::string& what);

  /// Call on any reader of the file after all reads. kWrongUse with every mistake so far, in order of lines and joined
  /// by "; ": wrong values, and "robot.yaml:12: unknown key 'link.protfile'; known: domain, profile, site".
  Result<void> finish() const;

 private:
  struct Mapping;
  struct Document;
  ConfigReader(std::shared_ptr<Document> document, Mapping* mapping);
  void readInteger(const std::string& key, int64_t low, int64_t high, int64_t& value);
  std::shared_ptr<Document> document_;
  Mapping* mapping_;  // lives in document_
};

}  // namespace comap
