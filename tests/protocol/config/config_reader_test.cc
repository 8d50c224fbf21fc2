#include "protocol/config/config_reader.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <random>

#include "protocol/config/yaml_text.h"

namespace comap {
namespace {

using testing::HasSubstr;
using testing::Not;

struct Robot {
  std::string name = "r0", profile = "local";
  int domain = 42;
  uint32_t budget = 1000;
  int64_t seed = 1;
  double radius_m = 3.5;
  float sigma = 0.5f;
  bool realtime = false;
};

Result<Robot> read(const std::string& text) {
  auto reader = ConfigReader::fromText(text, "robot.yaml");
  if (!reader) return reader.error();
  Robot robot;
  reader->read("name", robot.name);
  reader->read("realtime", robot.realtime);
  reader->read("seed", robot.seed);
  ConfigReader link = reader->section("link");
  link.read("domain", robot.domain, 0, 230);
  link.read("profile", robot.profile, {"local", "lan", "wan"});
  link.read("budget_bytes_per_s", robot.budget, 1);
  ConfigReader map = reader->section("map");
  map.read("radius_m", robot.radius_m, 0.1, 100);
  map.read("sigma", robot.sigma, 0);
  if (auto finished = reader->finish(); !finished) return finished.error();
  return robot;
}

std::string problem(const std::string& text) {
  const auto robot = read(text);
  return robot ? std::string("accepted") : robot.error().text;
}

TEST(ConfigReader, ReadsEveryType) {
  const auto robot = read(R"(
name: "r 7"   # quoted
realtime: true
seed: -9000000000
link:
  domain: 7
  profile: lan
  budget_bytes_per_s: 4000000000
map: {radius_m: 1.5e1, sigma: 0.25}
)");
  ASSERT_TRUE(robot) << robot.error().text;
  EXPECT_EQ(robot->name, "r 7");
  EXPECT_TRUE(robot->realtime);
  EXPECT_EQ(robot->seed, -9000000000);
  EXPECT_EQ(robot->domain, 7);
  EXPECT_EQ(robot->profile, "lan");
  EXPECT_EQ(robot->budget, 4000000000u);
  EXPECT_EQ(robot->radius_m, 15);
  EXPECT_EQ(robot->sigma, 0.25f);
}

TEST(ConfigReader, WhatIsNotThereKeepsItsDefault) {
  for (const char* text : {"", "# nothing\n", "link:\n", "{}"}) {
    const auto robot = read(text);
    ASSERT_TRUE(robot) << robot.error().text;
    EXPECT_EQ(robot->domain, 42);
    EXPECT_EQ(robot->name, "r0");
    EXPECT_EQ(robot->radius_m, 3.5);
  }
}

TEST(ConfigReader, AnUnknownKeyIsToldWithItsLineAndTheKnownOnes) {
  EXPECT_EQ(problem("name: a\nlink:\n  domain: 1\n  protfile: lan\n"),
            "robot.yaml:4: unknown key 'link.protfile'; known: budget_bytes_per_s, domain, profile");
  EXPECT_THAT(problem("nam: a\n"), HasSubstr("robot.yaml:1: unknown key 'nam'; known: link, map, name"));
}

TEST(ConfigReader, EveryMistakeIsToldInOrderOfLines) {
  const std::string text = problem("zeal: 1\nrealtime: yes\nlink:\n  domain: 231\n  extra: 2\nmap:\n  radius_m: far\n");
  EXPECT_EQ(text,
            "robot.yaml:1: unknown key 'zeal'; known: link, map, name, realtime, seed; "
            "robot.yaml:2: realtime: is 'yes', expected true or false; "
            "robot.yaml:4: link.domain: is '231', expected a whole number from 0 to 230; "
            "robot.yaml:5: unknown key 'link.extra'; known: budget_bytes_per_s, domain, profile; "
            "robot.yaml:7: map.radius_m: is 'far', expected a number from 0.1 up to 100");
}

TEST(ConfigReader, RefusesValuesOfAnotherType) {
  for (const char* value : {"1.5", "0x10", "1e2", "ten", "\"7\"", "''", "99999999999999999999", "-1", "7 8"}) {
    EXPECT_THAT(problem(std::string("link:\n  domain: ") + value), HasSubstr("robot.yaml:2: link.domain")) << value;
  }
  for (const char* value : {"nan", ".inf", "1m", "0.09", "101", "\"5\"", "1,5"}) {
    EXPECT_THAT(problem(std::string("map:\n  radius_m: ") + value), HasSubstr("robot.yaml:2: map.radius_m")) << value;
  }
  for (const char* value : {"True", "1", "on", "\"true\""}) {
    EXPECT_THAT(problem(std::string("realtime: ") + value), HasSubstr("robot.yaml:1: realtime")) << value;
  }
  EXPECT_EQ(problem("link:\n  profile: wlan"),
            "robot.yaml:2: link.profile: is 'wlan', expected one of local, lan, wan");
  EXPECT_EQ(problem("name: [a, b]"), "robot.yaml:1: name: is a list, expected text");
  EXPECT_EQ(problem("name: {a: b}"), "robot.yaml:1: name: is a section, expected text");
  EXPECT_EQ(problem("name:"), "robot.yaml:1: name: is empty, expected text");
  EXPECT_THAT(problem("link: 5"), HasSubstr("robot.yaml:1: link: is no section"));
  EXPECT_THAT(problem("link: [1]"), HasSubstr("robot.yaml:1: link: is no section"));
}

TEST(ConfigReader, RefusesWhatIsNoMapping) {
  EXPECT_THAT(problem("- a\n- b\n"), HasSubstr("robot.yaml:1: expected 'key: value' lines"));
  EXPECT_THAT(problem("just words"), HasSubstr("expected 'key: value' lines"));
  EXPECT_THAT(problem("a: [1\n"), HasSubstr("no YAML"));
  EXPECT_THAT(problem("name: a\nname: b\n"), HasSubstr("robot.yaml:2: key 'name' stands there twice"));
  EXPECT_THAT(problem("? [a]\n: b\n"), HasSubstr("is no plain word"));
  EXPECT_THAT(problem(std::string((1 << 20) + 1, '#')), HasSubstr("over 1 MiB"));
}

TEST(ConfigReader, TheCallersOwnMistakesJoinIn) {
  auto reader = ConfigReader::fromText("a: 1\nb: 2\n", "x.yaml");
  ASSERT_TRUE(reader);
  int a = 0, b = 0;
  reader->read("a", a);
  reader->read("b", b);
  reader->complain("b", "must be below a");
  const auto finished = reader->finish();
  ASSERT_FALSE(finished);
  EXPECT_EQ(finished.error().code, ErrorCode::kWrongUse) << "no new start mends it";
  EXPECT_EQ(finished.error().text, "x.yaml:2: b: must be below a");
}

TEST(ConfigReader, ReadsFilesAndTellsWhenItCannot) {
  const auto path = std::filesystem::temp_directory_path() / ("config_reader_test." + std::to_string(getpid()));
  std::ofstream(path) << "name: a\n";
  auto reader = ConfigReader::fromFile(path);
  ASSERT_TRUE(reader) << reader.error().text;
  std::string name;
  reader->read("name", name);
  EXPECT_EQ(name, "a");
  std::ofstream(path) << std::string((1 << 20) + 5, '#');
  EXPECT_THAT(ConfigReader::fromFile(path).error().text, HasSubstr("over 1 MiB"));
  std::filesystem::remove(path);
  const auto missing = ConfigReader::fromFile(path);
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::kUnreachable);
  EXPECT_FALSE(ConfigReader::fromFile("/"));
}

TEST(YamlText, IsReadBackAsItWas) {
  for (const std::string text :
       {"", "a", "o\"t \" au", "back\\slash", "a: b # c", "- x", "{}", "two\nlines\t", "\x01", "\xc3\xa4"}) {
    std::string back;
    auto reader = ConfigReader::fromText("name: " + yamlText(text) + "  # a comment\n", "t.yaml");
    ASSERT_TRUE(reader) << text;
    reader->read("name", back);
    EXPECT_TRUE(reader->finish()) << text;
    EXPECT_EQ(back, text);
  }
  const auto reader = ConfigReader::fromText("name: " + yamlText("\xff\xfe") + "\n", "t.yaml");
  ASSERT_TRUE(reader) << "bytes that are no text are replaced, and the file can be read";
}

TEST(ConfigReader, SurvivesHostileText) {
  const std::string good = "name: a\nlink:\n  domain: 7\nmap: {radius_m: 1.5, sigma: &x 0.25}\nseed: *x\n";
  std::mt19937 random(1);
  for (int round = 0; round < 3000; ++round) {
    std::string bad = good;
    for (int hits = 0; hits < 3; ++hits) bad[random() % bad.size()] = static_cast<char>(random());
    if (!read(bad)) {
      EXPECT_THAT(problem(bad), HasSubstr("robot.yaml"));
    }
  }
  EXPECT_THAT(problem(std::string(100000, '[')), Not(HasSubstr("accepted")));
  EXPECT_THAT(problem(std::string(100000, '{')), Not(HasSubstr("accepted")));
  // A graph that holds itself, and one that would unfold without end.
  EXPECT_THAT(problem("name: &a [*a]"), Not(HasSubstr("accepted")));
  EXPECT_THAT(problem("link: &a {link: *a}"), Not(HasSubstr("accepted")));
}

}  // namespace
}  // namespace comap
