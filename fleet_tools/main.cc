// The fleet's tools: one program, one verb a task.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include "fleet_tools/command_line/fleet_app.h"
#include "fleet_tools/command_line/text_table.h"
#include "protocol/program/out_of_memory.h"
#include "protocol/program/standard_output.h"
#include "protocol/types/result.h"

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
  const std::string verb = argc > 1 ? argv[1] : "";
  comap::tellWhenOutOfMemory(
      "fleet " + comap::printable(verb),
      verb == "replay" ? "fewer robots, or fewer frames of each (NAME=DIR@FIRST:LAST), need less"
                       : "of what computes maps, a smaller fusion.memory_mb in --config needs less; else give it more");
  try {
    app->parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app->exit(error) == 0 ? 0 : 2;
  } catch (const std::bad_alloc&) {
    return comap::exitCodeOf(comap::ErrorCode::kOutOfMemory);  // it was told
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fleet: %s\n", error.what());
    return 3;
  }
  return exit_code;
}
