// A command line as shells and manual pages need it, taken from the tree that parses it.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <utility>
#include <vector>

namespace comap {

/// One option or positional argument.
struct OptionWords {
  std::vector<std::string> names;    ///< "--out", "-o"; empty for a positional
  std::string positional;            ///< its name, empty for an option
  std::string text;                  ///< what it is for
  std::vector<std::string> choices;  ///< the values that it takes, if they are few
  bool takes_value = false, required = false;
};

/// In the order in which they were added, --help first.
std::vector<OptionWords> optionsOf(const CLI::App& command);

/// What is below `command` in the order of addition, each with its path: "keys make". Without `command` itself.
std::vector<std::pair<std::string, const CLI::App*>> verbsOf(const CLI::App& command);

/// A script for bash or zsh that completes verbs, options and the few values of options; files for the rest.
std::string bashCompletion(const CLI::App& app);
std::string zshCompletion(const CLI::App& app);

/// A manual page (troff, section 1) of one command. `path`: "fleet keys make".
std::string manPage(const CLI::App& command, const std::string& path);

}  // namespace comap
