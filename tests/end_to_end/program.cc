#include "tests/end_to_end/program.h"

#include <sys/wait.h>

#include <cstdlib>

#include "tests/files/temporary_folder.h"

namespace comap {

ProgramRun runProgram(const std::string& command, const std::string& environment) {
  const TemporaryFolder folder;
  const std::string line = "env " + environment + " " COMAP_BIN_DIR "/" + command + " >" + folder.path("out") + " 2>" +
                           folder.path("err") + " </dev/null";
  const int status = std::system(line.c_str());
  ProgramRun run;
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  run.out = contentOf(folder.path("out"));
  run.err = contentOf(folder.path("err"));
  return run;
}

}  // namespace comap
