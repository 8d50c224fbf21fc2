#include "protocol/telemetry/service_manager.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

namespace comap {
namespace {

// What systemd is to a service: a datagram socket named in the environment.
class Listener {
 public:
  Listener() : path_("/tmp/comap-notify-" + std::to_string(getpid())) {
    unlink(path_.c_str());
    fd_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path_.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    setenv("NOTIFY_SOCKET", path_.c_str(), 1);
  }
  ~Listener() {
    unsetenv("NOTIFY_SOCKET");
    close(fd_);
    unlink(path_.c_str());
  }
  std::string heard() const {
    std::array<char, 1024> text;
    const ssize_t n = recv(fd_, text.data(), text.size(), 0);
    return n < 0 ? "" : std::string(text.data(), static_cast<size_t>(n));
  }

 private:
  std::string path_;
  int fd_ = -1;
};

TEST(ServiceManager, ReadyIsToldOnceAndLifeEachTime) {
  const Listener systemd;
  ServiceManager manager;
  manager.alive("2 robots");
  EXPECT_EQ(systemd.heard(), "WATCHDOG=1\nREADY=1\nSTATUS=2 robots\n");
  manager.alive("2 robots");
  EXPECT_EQ(systemd.heard(), "WATCHDOG=1\n");
  manager.alive("two\nlines");
  EXPECT_EQ(systemd.heard(), "WATCHDOG=1\nSTATUS=two lines\n");
  manager.stopping(90);
  EXPECT_EQ(systemd.heard(), "STOPPING=1\nEXTEND_TIMEOUT_USEC=90000000");
}

TEST(ServiceManager, WithoutOneNothingHappens) {
  unsetenv("NOTIFY_SOCKET");
  ServiceManager manager;
  manager.alive("alone");
  manager.stopping(1);
}

}  // namespace
}  // namespace comap
