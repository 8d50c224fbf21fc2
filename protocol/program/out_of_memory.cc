#include "protocol/program/out_of_memory.h"

#include <unistd.h>

#include <new>

namespace comap {
namespace {

std::string told;  // NOLINT: written once, before the handler is there

void tell() {
  std::set_new_handler(nullptr);  // tried once more, and then it fails
  [[maybe_unused]] const auto written = write(STDERR_FILENO, told.data(), told.size());
}

}  // namespace

void tellWhenOutOfMemory(const std::string& program, const std::string& advice) {
  told = program + ": no memory is left: " + advice + "\n";
  std::set_new_handler(tell);
}

}  // namespace comap
