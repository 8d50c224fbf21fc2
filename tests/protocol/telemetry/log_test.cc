#include "protocol/telemetry/log.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <regex>
#include <sstream>

namespace comap {
namespace {

template <class Speak>
std::string written(Speak speak) {
  char* text = nullptr;
  size_t size = 0;
  std::FILE* file = open_memstream(&text, &size);
  speak(file);
  std::fclose(file);
  std::string result(text, size);
  std::free(text);
  return result;
}

TEST(Log, TextIsTheLineAndErrorsNameTheProgram) {
  EXPECT_EQ(written([](std::FILE* out) {
              const Log log(LogFormat::kText, "mapping_core", out);
              log.info("robot a is here");
              log.error("no such file");
            }),
            "robot a is here\nmapping_core: no such file\n");
}

TEST(Log, JsonIsAnObjectALineWhateverTheTextHolds) {
  const std::string nasty = std::string("quote \" backslash \\ newline \n bell \a bytes \xff\xfe", 43);
  const std::string text = written([&](std::FILE* out) {
    const Log log(LogFormat::kJson, "edge_agent", out);
    log.info(nasty);
    log.error("bad");
  });
  std::istringstream lines(text);
  std::string line;
  ASSERT_TRUE(std::getline(lines, line));
  const auto first = nlohmann::json::parse(line);
  EXPECT_EQ(first.at("program"), "edge_agent");
  EXPECT_EQ(first.at("level"), "info");
  EXPECT_EQ(first.at("text").get<std::string>().substr(0, 25), nasty.substr(0, 25));
  EXPECT_TRUE(
      std::regex_match(first.at("time").get<std::string>(), std::regex(R"(\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z)")));
  ASSERT_TRUE(std::getline(lines, line));
  EXPECT_EQ(nlohmann::json::parse(line).at("level"), "error");
  EXPECT_FALSE(std::getline(lines, line));
}

}  // namespace
}  // namespace comap
