// A network between network namespaces that loses, delays, doubles, reorders and chokes packets, and can be cut; at the
// end it tells what each cable carried.
//   relay NAMESPACE=ADDRESS ...    commands on stdin, a line each:
//   set NAMESPACE|all [loss=PERCENT] [delay=MS] [jitter=MS] [double=PERCENT] [rate=BITS_PER_S] [up=0|1]
// Makes an interface tun0 in each namespace. What is set holds for both directions of that namespace's cable, half of
// delay each; rate for what leaves the namespace. Prints "ready"; ends with stdin. Needs root. For kernels without
// netem.
#include <arpa/inet.h>
#include <fcntl.h>
#include <linux/if_tun.h>
#include <net/if.h>
#include <poll.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <queue>
#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace {

using Clock = std::chrono::steady_clock;
using Milliseconds = std::chrono::duration<double, std::milli>;

constexpr size_t kQueueBytes = 256 * 1024;  // of a choked cable: what a usual modem buffers

struct Cable {
  std::string name;
  int tun = -1;
  double loss = 0, delay_ms = 0, jitter_ms = 0, doubled = 0, rate = 0;
  bool up = true;
  Clock::time_point free_at;  // when the next packet may start out of the namespace
  unsigned long long out_bytes = 0, in_bytes = 0, lost_bytes = 0;
};

struct Packet {
  Clock::time_point due;
  size_t to;
  std::vector<unsigned char> bytes;
  bool operator>(const Packet& other) const { return due > other.due; }
};

[[noreturn]] void fail(const std::string& what) {
  std::perror(("relay: " + what).c_str());
  std::exit(3);
}

int run(const std::string& command) { return std::system(command.c_str()); }

int openTun(const std::string& name, const std::string& address) {
  const int home = open("/proc/self/ns/net", O_RDONLY | O_CLOEXEC);
  const int there = open(("/run/netns/" + name).c_str(), O_RDONLY | O_CLOEXEC);
  if (home < 0 || there < 0 || setns(there, CLONE_NEWNET) != 0) fail("namespace " + name);
  const int tun = open("/dev/net/tun", O_RDWR | O_CLOEXEC | O_NONBLOCK);
  ifreq request{};
  request.ifr_flags = IFF_TUN | IFF_NO_PI;
  std::strcpy(request.ifr_name, "tun0");
  if (tun < 0 || ioctl(tun, TUNSETIFF, &request) != 0) fail("tun0 in " + name);
  if (run("ip addr add " + address +
          "/24 dev tun0 && ip link set tun0 multicast on txqueuelen 2000 up && ip link set lo up "
          "&& ip route add 224.0.0.0/4 dev tun0") != 0)
    fail("addresses in " + name);
  if (setns(home, CLONE_NEWNET) != 0) fail("the way back from " + name);
  close(home);
  close(there);
  return tun;
}

class Relay {
 public:
  void add(const std::string& name, const std::string& address) {
    Cable cable;
    cable.name = name;
    cable.tun = openTun(name, address);
    cables_.push_back(cable);
  }

  void work() {
    std::vector<pollfd> waits{{STDIN_FILENO, POLLIN, 0}};
    for (const Cable& cable : cables_) waits.push_back({cable.tun, POLLIN, 0});
    std::string commands;
    for (;;) {
      int wait_ms = 1000;
      if (!queue_.empty())
        wait_ms = std::max(0, static_cast<int>(std::ceil(Milliseconds(queue_.top().due - Clock::now()).count())));
      if (poll(waits.data(), waits.size(), wait_ms) < 0 && errno != EINTR) fail("poll");
      while (!queue_.empty() && queue_.top().due <= Clock::now()) {
        const Packet& packet = queue_.top();
        if (write(cables_[packet.to].tun, packet.bytes.data(), packet.bytes.size()) < 0) ++dropped_;
        queue_.pop();
      }
      for (size_t i = 0; i < cables_.size(); ++i)
        if (waits[i + 1].revents & POLLIN) takeFrom(i);
      if (waits[0].revents == 0) continue;
      char text[4096];
      const ssize_t size = read(STDIN_FILENO, text, sizeof text);
      if (size <= 0) break;
      commands.append(text, static_cast<size_t>(size));
      for (size_t end; (end = commands.find('\n')) != std::string::npos; commands.erase(0, end + 1))
        obey(commands.substr(0, end));
    }
    for (const Cable& cable : cables_)
      std::printf("%s: %llu kB out, %llu kB in, %llu kB lost\n", cable.name.c_str(), cable.out_bytes / 1000,
                  cable.in_bytes / 1000, cable.lost_bytes / 1000);
  }

 private:
  void obey(const std::string& line) {
    std::istringstream words(line);
    std::string verb, name, word;
    words >> verb >> name;
    while (words >> word) {
      const size_t equal = word.find('=');
      if (verb != "set" || equal == std::string::npos) fail("command '" + line + "'");
      const double value = std::atof(word.c_str() + equal + 1);
      const std::string key = word.substr(0, equal);
      for (Cable& cable : cables_) {
        if (name != "all" && name != cable.name) continue;
        if (key == "loss")
          cable.loss = value / 100;
        else if (key == "delay")
          cable.delay_ms = value;
        else if (key == "jitter")
          cable.jitter_ms = value;
        else if (key == "double")
          cable.doubled = value / 100;
        else if (key == "rate")
          cable.rate = value;
        else if (key == "up")
          cable.up = value != 0;
        else
          fail("key '" + key + "'");
      }
    }
  }

  bool chance(double share) { return share > 0 && std::uniform_real_distribution<double>()(random_) < share; }

  void takeFrom(size_t from) {
    unsigned char bytes[65536];
    for (int burst = 0; burst < 64; ++burst) {
      const ssize_t size = read(cables_[from].tun, bytes, sizeof bytes);
      if (size < 20 || bytes[0] >> 4 != 4) {
        if (size <= 0) return;
        continue;  // not IPv4
      }
      uint32_t source, target;
      std::memcpy(&source, bytes + 12, 4);
      std::memcpy(&target, bytes + 16, 4);
      at_[source] = from;
      const auto known = at_.find(target);
      const bool multicast = (bytes[16] & 0xf0) == 0xe0;
      for (size_t to = 0; to < cables_.size(); ++to)
        if (to != from && (multicast || known == at_.end() || known->second == to))
          send(from, to, {bytes, bytes + size});
    }
  }

  // One cable: false if the packet is lost on it; else adds the time that it takes.
  bool pass(Cable& cable, int direction, size_t bytes, Clock::time_point& when) {
    cable.lost_bytes += bytes;  // until it is through
    if (!cable.up || chance(cable.loss)) return false;
    double extra_ms = cable.delay_ms / 2;
    if (cable.jitter_ms > 0) extra_ms += std::uniform_real_distribution<double>(0, cable.jitter_ms)(random_);
    if (cable.rate > 0 && direction == 0) {
      Clock::time_point& free_at = cable.free_at;
      free_at = std::max(free_at, when);
      if (std::chrono::duration<double>(free_at - when).count() * cable.rate / 8 > kQueueBytes) return false;
      free_at += std::chrono::duration_cast<Clock::duration>(
          std::chrono::duration<double>(static_cast<double>(bytes) * 8 / cable.rate));
      when = free_at;
    }
    when += std::chrono::duration_cast<Clock::duration>(Milliseconds(extra_ms));
    cable.lost_bytes -= bytes;
    (direction == 0 ? cable.out_bytes : cable.in_bytes) += bytes;
    return true;
  }

  void send(size_t from, size_t to, std::vector<unsigned char> bytes) {
    const int copies = chance(cables_[from].doubled) || chance(cables_[to].doubled) ? 2 : 1;
    for (int i = 0; i < copies; ++i) {
      Clock::time_point when = Clock::now();
      if (pass(cables_[from], 0, bytes.size(), when) && pass(cables_[to], 1, bytes.size(), when))
        queue_.push({when, to, bytes});
    }
  }

  std::vector<Cable> cables_;
  std::map<uint32_t, size_t> at_;  // which cable an address was last seen on
  std::priority_queue<Packet, std::vector<Packet>, std::greater<>> queue_;
  std::mt19937 random_{1};
  uint64_t dropped_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  Relay relay;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const size_t equal = word.find('=');
    if (equal == std::string::npos) {
      std::fprintf(stderr, "relay: '%s', expected NAMESPACE=ADDRESS\n", argv[i]);
      return 2;
    }
    relay.add(word.substr(0, equal), word.substr(equal + 1));
  }
  std::puts("ready");
  std::fflush(stdout);
  relay.work();
}
