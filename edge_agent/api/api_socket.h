// The place in the file system where programs on the robot find its agent.
#pragma once

#include <string>

#include "protocol/types/result.h"

namespace comap {

struct ApiOptions {
  std::string socket;  ///< path; empty: no programs are let in
  bool group = false;  ///< the group of the agent may read too, else only its own user
};

/// A listening socket, whose name in the file system it takes away when it ends.
class ApiSocket {
 public:
  /// Takes over a name that an agent has left behind that is no more. kUnreachable if another agent listens there, it
  /// is no socket, or it cannot be made; kWrongUse if the path is too long for a socket.
  static Result<ApiSocket> listen(const ApiOptions& options);
  ApiSocket(ApiSocket&& other) noexcept;
  ApiSocket& operator=(ApiSocket&&) = delete;
  ~ApiSocket();

  int descriptor() const { return fd_; }
  /// The next who knocks; -1 if there is nobody, or no descriptor for him.
  int accept() const;

 private:
  ApiSocket(int fd, std::string path, uint64_t device, uint64_t inode)
      : fd_(fd), path_(std::move(path)), device_(device), inode_(inode) {}
  int fd_;
  std::string path_;
  uint64_t device_, inode_;  // what of that name is this one
};

}  // namespace comap
