// The fleet's tools: one program, one verb a task.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "fleet_tools/command_line/fleet_app.h"
#include "fleet_tools/command_line/text_table.h"
#include "protocol/program/standard_output.h"

int main(int argc, char** argv) {
  comap::failOnLostOutput("fleet");
  int exit_code = 0;
  const auto app = comap::makeFleetApp(exit_code);
  const auto verbs = app->get_subcommands({});
  if (argc > 1 && argv[1][0] != '-' &&
      std::none_of(verbs.begin(), verbs.end(), [&](const CLI::App* verb) { return verb->check_name(argv[1]); })) {
    std::fprintf(stderr, "fleet: %s: no such verb; fleet --help lists them\n", comap::printable(argv[1]).c_str());
    return 2;
  }
  try {
    app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app->exit(error) == 0 ? 0 : 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fleet: %s\n", error.what());
    return 3;
  }
  return exit_code;
}
