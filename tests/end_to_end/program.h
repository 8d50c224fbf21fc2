// Runs one of the project's programs as a shell would and keeps what it said.
#pragma once

#include <filesystem>
#include <string>

namespace comap {

struct ProgramRun {
  int exit_code = -1;
  std::string out, err;
};

/// `command`: "fleet replay ..." and so on; the program comes from the build's bin folder. `environment`: "A=b C=d".
ProgramRun runProgram(const std::string& command, const std::string& environment = "");

/// A new empty folder that goes away with this object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string path(const std::string& name = "") const { return name.empty() ? path_ : path_ + "/" + name; }

 private:
  std::string path_;
};

}  // namespace comap
