// Runs one of the project's programs as a shell would and keeps what it said.
#pragma once

#include <string>

namespace comap {

struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

/// `command`: "fleet replay ..." and so on; the program comes from the build's bin folder. `environment`: "A=b C=d".
ProgramRun runProgram(const std::string& command, const std::string& environment = "");

}  // namespace comap
