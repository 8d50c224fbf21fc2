// How the programs that measure read their arguments.
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <optional>
#include <string>

namespace comap {

/// The exit code, if the program ends here: 0 after --help, 2 for wrong use.
inline std::optional<int> endOfParsing(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return std::nullopt;
}

/// A number from 0 on, which infinity and what is no number are not.
inline CLI::Validator finiteFromZero() {
  return CLI::Validator(
      [](std::string& text) -> std::string {
        double value = 0;
        const bool read = CLI::detail::lexical_cast(text, value);
        return read && std::isfinite(value) && value >= 0 ? "" : "'" + text + "' is no finite number from 0 on";
      },
      "NUMBER>=0");
}

}  // namespace comap
