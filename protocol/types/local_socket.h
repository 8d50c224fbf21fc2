// Sockets between programs of one machine, which have a path.
#pragma once

#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <string>

namespace comap {

inline constexpr size_t kMostSocketPathBytes = sizeof(sockaddr_un::sun_path) - 1;

namespace local_socket {

using Call = int (*)(int, const sockaddr*, socklen_t);
inline int withAddress(Call call, int fd, const std::string& path) {
  if (path.empty() || path.size() > kMostSocketPathBytes) {
    errno = ENAMETOOLONG;
    return -1;
  }
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::copy(path.begin(), path.end(), address.sun_path);
  return call(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address);
}

}  // namespace local_socket

/// As connect(2) and bind(2), with a path of 1 to kMostSocketPathBytes bytes.
inline int connectSocket(int fd, const std::string& path) { return local_socket::withAddress(::connect, fd, path); }
inline int bindSocket(int fd, const std::string& path) { return local_socket::withAddress(::bind, fd, path); }

}  // namespace comap
