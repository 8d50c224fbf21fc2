// The graph mode and the paper mode on the same input, side by side.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace comap {

/// One input, run in both modes; the reports are evaluated if there was a truth.
struct ComparedInput {
  std::string name;  ///< "a", "b", "a+b"
  nlohmann::json graph, paper;
  /// The paper mode again, with the remedy of that name, or "all".
  std::vector<std::pair<std::string, nlohmann::json>> remedies{};
};

/// compare.json: of each input and mode the numbers that both have, and what they say: `at_least_as_accurate` (every
/// error that both have, doubles, maps and false merges; null: `not_known_because`), `a_tenth_of_the_bytes`, in words
/// what is not so (`not_so`), and what errors are missing, of different frames or of part of the maps, who was lost,
/// and remedies (`notes`). Keys that a report lacks are null.
nlohmann::json compareJson(const std::vector<ComparedInput>& inputs);

/// The runs of one input of compare.json, by what the table calls them: "graph", "paper" (and what it ran with:
/// "paper + REMEDY"), "+ REMEDY".
std::vector<std::pair<std::string, nlohmann::json>> rowsOf(const nlohmann::json& input);
/// "a:98/100 b:100/100": poses that errors are of, and frames.
std::string framesText(const nlohmann::json& numbers);

/// For a terminal: one line an input and mode, then the words.
std::string compareText(const nlohmann::json& comparison);

}  // namespace comap
