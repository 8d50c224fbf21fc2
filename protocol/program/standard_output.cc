#include "protocol/program/standard_output.h"

#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>

#include "protocol/types/result.h"

namespace comap {
namespace {

const char* g_program = "";  // whoever exits tells nobody else

void checkOutput() {
  std::cout.flush();
  errno = 0;
  const bool lost = std::ferror(stdout) != 0, flushed = std::fflush(stdout) == 0;
  if ((!lost && flushed) || errno == EPIPE) return;
  // Of what was lost before this flush, the reason is forgotten.
  const char* why = flushed ? "" : std::strerror(errno);
  std::fprintf(stderr, "%s: cannot write all of its output%s%s\n", g_program, flushed ? "" : ": ", why);
  std::fflush(stderr);
  _exit(exitCodeOf(ErrorCode::kUnreachable));
}

}  // namespace

void failOnLostOutput(const char* program) {
  g_program = program;
  std::atexit(checkOutput);
}

}  // namespace comap
