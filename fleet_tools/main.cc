// The fleet's tools: one program, one verb a task.
#include <cstdio>
#include <exception>

#include "fleet_tools/command_line/fleet_app.h"

int main(int argc, char** argv) {
  int exit_code = 0;
  const auto app = comap::makeFleetApp(exit_code);
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
