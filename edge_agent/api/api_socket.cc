#include "edge_agent/api/api_socket.h"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace comap {
namespace {

constexpr int kKnocking = 16;  // not yet accepted

Error problem(const std::string& path, const std::string& what) {
  return {ErrorCode::kUnreachable, "api.socket: " + path + ": " + what};
}

int newSocket() { return ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0); }

// Makes way: a socket that nobody listens at has been left by an agent that was killed.
Result<void> clear(const std::string& path, const sockaddr_un& address) {
  struct stat there {};
  if (::lstat(path.c_str(), &there) != 0) {
    if (errno == ENOENT) return {};
    return problem(path, std::strerror(errno));
  }
  if (!S_ISSOCK(there.st_mode)) return problem(path, "is there already and no socket");
  const int fd = newSocket();
  if (fd < 0) return problem(path, std::strerror(errno));
  const bool answered = ::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
                        errno == EAGAIN;  // its queue is full
  const int why = errno;
  ::close(fd);
  if (answered) return problem(path, "another agent listens there");
  if (why != ECONNREFUSED) return problem(path, std::strerror(why));
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) return problem(path, std::strerror(errno));
  return {};
}

}  // namespace

Result<ApiSocket> ApiSocket::listen(const ApiOptions& options) {
  const std::string& path = options.socket;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return Error{ErrorCode::kWrongUse, "api.socket has " + std::to_string(path.size()) + " bytes; 1 to " +
                                           std::to_string(sizeof address.sun_path - 1) + " are expected"};
  std::copy(path.begin(), path.end(), address.sun_path);
  if (auto cleared = clear(path, address); !cleared) return cleared.error();
  const int fd = newSocket();
  if (fd < 0) return problem(path, std::strerror(errno));
  const auto failed = [&] {
    const int why = errno;
    ::close(fd);
    return problem(path, std::strerror(why));
  };
  // From its first moment nobody else may open it; the umask only takes away.
  const mode_t mode = options.group ? 0660 : 0600;
  if (::fchmod(fd, mode) != 0) return failed();
  if (::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) return failed();
  struct stat made {};
  if (::chmod(path.c_str(), mode) != 0 || ::lstat(path.c_str(), &made) != 0 || ::listen(fd, kKnocking) != 0) {
    const int why = errno;
    ::unlink(path.c_str());
    errno = why;
    return failed();
  }
  return ApiSocket(fd, path, made.st_dev, made.st_ino);
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
