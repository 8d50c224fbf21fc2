#include "edge_agent/api/api_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "protocol/types/local_socket.h"

namespace comap {
namespace {

constexpr int kKnocking = 16;  // not yet accepted

Error problem(const std::string& path, const std::string& what) {
  return {ErrorCode::kUnreachable, "api.socket: " + path + ": " + what};
}

int newSocket() { return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0); }

// A socket that nobody listens at has been left by an agent that was killed: it may go.
Result<void> checkFree(const std::string& path) {
  struct stat there {};
  if (::lstat(path.c_str(), &there) != 0) {
    if (errno == ENOENT) return {};
    return problem(path, std::strerror(errno));
  }
  if (!S_ISSOCK(there.st_mode)) return problem(path, "is there already and no socket");
  const int fd = newSocket();
  if (fd < 0) return problem(path, std::strerror(errno));
  const bool answered = connectSocket(fd, path) == 0 || errno == EAGAIN;  // its queue is full
  const int why = errno;
  ::close(fd);
  if (answered) return problem(path, "another agent listens there");
  return why == ECONNREFUSED ? Result<void>() : problem(path, std::strerror(why));
}

}  // namespace

// Under another name until it listens: one that does not yet would be taken for one that was left behind.
Result<ApiSocket> ApiSocket::listen(const ApiOptions& options) {
  const std::string& path = options.socket;
  const std::string early = path + "~";
  if (path.empty() || early.size() > kMostSocketPathBytes)
    return Error{ErrorCode::kWrongUse, "api.socket has " + std::to_string(path.size()) + " bytes; 1 to " +
                                           std::to_string(kMostSocketPathBytes - 1) + " are expected"};
  for (const std::string& name : {path, early})
    if (auto checked = checkFree(name); !checked) return checked.error();
  ::unlink(early.c_str());
  const int fd = newSocket();
  if (fd < 0) return problem(path, std::strerror(errno));
  // From its first moment nobody else may open it; the umask only takes away.
  const mode_t mode = options.group ? 0660 : 0600;
  struct stat made {};
  const bool bound = ::fchmod(fd, mode) == 0 && bindSocket(fd, early) == 0;
  if (bound && ::chmod(early.c_str(), mode) == 0 && ::listen(fd, kKnocking) == 0 &&
      ::lstat(early.c_str(), &made) == 0 && ::rename(early.c_str(), path.c_str()) == 0)
    return ApiSocket(fd, path, made.st_dev, made.st_ino);
  const int why = errno;
  ::close(fd);
  if (bound) ::unlink(early.c_str());
  return problem(path, std::strerror(why));
}

ApiSocket::ApiSocket(ApiSocket&& other) noexcept
    : fd_(std::exchange(other.fd_, -1)), path_(std::move(other.path_)), device_(other.device_), inode_(other.inode_) {}

ApiSocket::~ApiSocket() {
  if (fd_ < 0) return;
  ::close(fd_);
  struct stat there {};
  if (::lstat(path_.c_str(), &there) == 0 && there.st_dev == device_ && there.st_ino == inode_) ::unlink(path_.c_str());
}

int ApiSocket::accept() const { return ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK); }

}  // namespace comap
