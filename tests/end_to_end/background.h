// A program in the background, to be killed and waited for.
#pragma once

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <optional>
#include <string>
#include <vector>

namespace comap {

// A program in the background, which does not outlive this object.
class Background {
 public:
  Background(const std::string& program, const std::vector<std::string>& arguments, const std::string& log) {
    std::vector<std::string> words = {std::string(COMAP_BIN_DIR "/") + program};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const int file = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
    pid_ = fork();
    if (pid_ == 0) {
      dup2(file, STDOUT_FILENO);
      dup2(file, STDERR_FILENO);
      execv(argv[0], argv.data());
      _exit(127);
    }
    close(file);
  }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  ~Background() { end(SIGKILL); }

  pid_t pid() const { return pid_; }
  bool runs() {
    int status = 0;
    if (!code_ && waitpid(pid_, &status, WNOHANG) == pid_) note(status);
    return !code_;
  }
  int wait() {
    int status = 0;
    if (!code_ && waitpid(pid_, &status, 0) == pid_) note(status);
    return code_.value_or(-1);
  }
  int end(int signal) {
    if (runs()) kill(pid_, signal);
    return wait();
  }

 private:
  void note(int status) { code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }
  pid_t pid_ = -1;
  std::optional<int> code_;
};

}  // namespace comap
