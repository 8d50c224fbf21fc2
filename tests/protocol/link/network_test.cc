// Links between two network namespaces, joined by a wire that is listened to, or by a router: what leaves the machine,
// and that it arrives. Needs root.
#include <arpa/inet.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/if_ether.h>
#include <linux/if_packet.h>
#include <netinet/ip.h>
#include <sched.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <thread>

#include "protocol/discovery/discovery_server.h"
#include "tests/protocol/link/site_keys.h"

extern char** environ;

namespace comap {
namespace {

constexpr const char* kCoreAddress = "10.78.0.1";
constexpr const char* kRobotAddress = "10.78.0.2";
constexpr const char* kFarRobotAddress = "10.79.0.2";                         // behind the router
constexpr Endpoint kServer{0x0a4e00fe, 7399, 0};                              // 10.78.0.254, the router itself
constexpr std::string_view kPattern = "comap-test-pattern-0123456789ABCDEF";  // as dds_peer's

int runCommand(const std::string& command) {
  const int status = std::system((command + " 2>/dev/null").c_str());
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

bool enter(const std::string& space) {
  const int file = open(("/run/netns/" + space).c_str(), O_RDONLY | O_CLOEXEC);
  const bool entered = file >= 0 && setns(file, CLONE_NEWNET) == 0;
  if (file >= 0) close(file);
  return entered;
}

// The kernel tells of a new wire when it has time: a second later, if busy.
bool awaitCarrier(const std::string& space) {
  for (int i = 0; i < 200; ++i) {
    if (runCommand("ip -n " + space + " link show v0 | grep -q 'state UP'") == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

// Two namespaces and a wire between them; no route to anywhere else.
class Wire {
 public:
  Wire() {
    for (const std::string& name : {core(), robot()})
      made_ = runCommand("ip netns add " + name) == 0 && runCommand("ip -n " + name + " link set lo up") == 0 && made_;
    made_ = made_ && runCommand("ip link add v0 netns " + core() + " type veth peer name v0 netns " + robot()) == 0;
    for (const auto& [name, address] : {std::pair(core(), kCoreAddress), std::pair(robot(), kRobotAddress)})
      made_ = made_ && runCommand("ip -n " + name + " addr add " + address + "/24 dev v0") == 0 &&
              runCommand("ip -n " + name + " link set v0 up") == 0 &&
              runCommand("ip -n " + name + " route add 224.0.0.0/4 dev v0") == 0;
    made_ = made_ && awaitCarrier(core()) && awaitCarrier(robot());
  }
  ~Wire() {
    for (const std::string& name : {core(), robot()}) runCommand("ip netns del " + name);
  }
  bool made() const { return made_; }
  static std::string core() { return "comap-core-" + std::to_string(getpid()); }
  static std::string robot() { return "comap-robot-" + std::to_string(getpid()); }

 private:
  bool made_ = true;
};

// Core and robot in two networks, which only a router joins; it lets no multicast through, and a discovery server runs
// on it.
class RoutedNetworks {
 public:
  RoutedNetworks() {
    for (const std::string& name : {Wire::core(), Wire::robot(), router()})
      made_ = runCommand("ip netns add " + name) == 0 && runCommand("ip -n " + name + " link set lo up") == 0 && made_;
    made_ = made_ && runCommand("ip netns exec " + router() + " sysctl -qw net.ipv4.ip_forward=1") == 0;
    for (const auto& [name, address, near, net] : {std::tuple(Wire::core(), kCoreAddress, "v1", "10.78.0"),
                                                   std::tuple(Wire::robot(), kFarRobotAddress, "v2", "10.79.0")})
      made_ = made_ &&
              runCommand("ip link add v0 netns " + name + " type veth peer name " + near + " netns " + router()) == 0 &&
              runCommand("ip -n " + router() + " addr add " + net + ".254/24 dev " + near) == 0 &&
              runCommand("ip -n " + router() + " link set " + near + " up") == 0 &&
              runCommand("ip -n " + name + " addr add " + address + "/24 dev v0") == 0 &&
              runCommand("ip -n " + name + " link set v0 up") == 0 &&
              runCommand("ip -n " + name + " route add default via " + net + ".254") == 0 && awaitCarrier(name);
  }
  ~RoutedNetworks() {
    for (const std::string& name : {Wire::core(), Wire::robot(), router()}) runCommand("ip netns del " + name);
  }
  bool made() const { return made_; }
  static std::string router() { return "comap-router-" + std::to_string(getpid()); }
  /// Threads begin in the network of who starts them.
  static std::unique_ptr<DiscoveryServer> serve() {
    std::unique_ptr<DiscoveryServer> server;
    std::thread([&] {
      if (!enter(router())) return;
      if (auto started = DiscoveryServer::start({0, kServer.port, 0}, [](const std::string&) {}))
        server = std::move(*started);
    }).join();
    return server;
  }

 private:
  bool made_ = true;
};

// Counts what passes the core's end of the wire.
class Capture {
 public:
  Capture() : thread_([this] { listen(); }) {
    while (!ready_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  ~Capture() { stop(); }
  void stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }

  bool listening = false;
  int datagrams = 0, with_pattern = 0, multicast = 0, fragments = 0;
  size_t largest_bytes = 0, bytes = 0;

 private:
  void listen() {
    // A thread may live in another network than its process.
    listening = enter(Wire::core());
    const int wire = socket(AF_PACKET, SOCK_DGRAM | SOCK_CLOEXEC, htons(ETH_P_IP));
    const timeval patience{0, 100000};
    const int room = 64 << 20;
    listening = listening && wire >= 0 && setsockopt(wire, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) == 0 &&
                setsockopt(wire, SOL_SOCKET, SO_RCVBUFFORCE, &room, sizeof room) == 0;
    ready_ = true;
    std::vector<uint8_t> packet(70000);
    while (listening && !stop_) {
      const ssize_t size = recv(wire, packet.data(), packet.size(), 0);
      if (size >= static_cast<ssize_t>(sizeof(iphdr))) count({packet.begin(), packet.begin() + size});
    }
    if (wire >= 0) close(wire);
  }
  void count(const std::vector<uint8_t>& packet) {
    iphdr header;
    std::memcpy(&header, packet.data(), sizeof header);
    if (header.protocol != IPPROTO_UDP) return;
    ++datagrams;
    bytes += packet.size();
    largest_bytes = std::max(largest_bytes, packet.size());
    fragments += (ntohs(header.frag_off) & (IP_MF | IP_OFFMASK)) != 0 ? 1 : 0;
    multicast += IN_MULTICAST(ntohl(header.daddr)) ? 1 : 0;
    with_pattern += std::search(packet.begin(), packet.end(), kPattern.begin(), kPattern.end()) != packet.end() ? 1 : 0;
  }

  std::atomic<bool> ready_ = false, stop_ = false;
  std::thread thread_;
};

pid_t start(const std::string& space, std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), {"ip", "netns", "exec", space, "timeout", "60", DDS_PEER});
  std::vector<char*> pointers;
  for (std::string& argument : arguments) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  pid_t child = 0;
  return posix_spawnp(&child, "ip", nullptr, nullptr, pointers.data(), environ) == 0 ? child : -1;
}

int exitCodeOf(pid_t child) {
  int status = 0;
  return waitpid(child, &status, 0) == child && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

struct Path {
  const char* name;
  const char* profile;
  bool keyed;
};

class Network : public testing::TestWithParam<Path> {};

TEST_P(Network, CarriesKeyframesUpAndTilesDown) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root for network namespaces";
  const Wire wire;
  if (!wire.made()) GTEST_SKIP() << "this kernel or container allows no network namespaces";
  SiteKeys keys("apart");
  const bool wan = std::string(GetParam().profile) == "wan";
  const std::string core_keys = GetParam().keyed ? keys.of(KeyRole::kCore, "core") : "-";
  const std::string robot_keys = GetParam().keyed ? keys.of(KeyRole::kRobot, "a") : "-";
  Capture capture;
  ASSERT_TRUE(capture.listening);
  const pid_t core = start(Wire::core(), {"core", kCoreAddress, GetParam().profile, "-", core_keys, "5"});
  const pid_t robot =
      start(Wire::robot(), {"robot", kRobotAddress, GetParam().profile, wan ? kCoreAddress : "-", robot_keys, "5"});
  EXPECT_EQ(exitCodeOf(robot), 0) << "the step that failed, see dds_peer";
  EXPECT_EQ(exitCodeOf(core), 0) << "the step that failed, see dds_peer";
  capture.stop();
  RecordProperty("datagrams", capture.datagrams);
  RecordProperty("kilobytes", static_cast<int>(capture.bytes / 1000));
  // 5 keyframes of 300 kB and a tile of 500 kB.
  EXPECT_GT(capture.datagrams, 1000);
  EXPECT_LE(capture.largest_bytes, 1428u) << "1400 bytes and the headers of IP and UDP";
  EXPECT_EQ(capture.fragments, 0);
  EXPECT_EQ(capture.multicast > 0, !wan) << capture.multicast;
  if (GetParam().keyed)
    EXPECT_EQ(capture.with_pattern, 0) << "of " << capture.datagrams << " datagrams";
  else
    EXPECT_GT(capture.with_pattern, 1000) << "else its absence elsewhere shows nothing";
}

TEST_P(Network, ThroughARouterADiscoveryServerIsEnough) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root for network namespaces";
  const RoutedNetworks networks;
  if (!networks.made()) GTEST_SKIP() << "this kernel or container allows no network namespaces";
  const auto server = RoutedNetworks::serve();
  ASSERT_TRUE(server);
  SiteKeys keys("apart");
  const std::string core_keys = GetParam().keyed ? keys.of(KeyRole::kCore, "core") : "-";
  const std::string robot_keys = GetParam().keyed ? keys.of(KeyRole::kRobot, "a") : "-";
  Capture capture;
  ASSERT_TRUE(capture.listening);
  const pid_t core = start(Wire::core(), {"core", kCoreAddress, GetParam().profile, toString(kServer), core_keys, "2"});
  const pid_t robot =
      start(Wire::robot(), {"robot", kFarRobotAddress, GetParam().profile, toString(kServer), robot_keys, "2"});
  EXPECT_EQ(exitCodeOf(robot), 0) << "the step that failed, see dds_peer";
  EXPECT_EQ(exitCodeOf(core), 0) << "the step that failed, see dds_peer";
  capture.stop();
  EXPECT_GT(capture.datagrams, 400);
  EXPECT_EQ(capture.fragments, 0);
  EXPECT_EQ(capture.multicast, 0);
  EXPECT_EQ(capture.with_pattern > 0, !GetParam().keyed);
}

INSTANTIATE_TEST_SUITE_P(Paths, Network,
                         testing::Values(Path{"Lan", "lan", false}, Path{"KeyedLan", "lan", true},
                                         Path{"Wan", "wan", false}, Path{"KeyedWan", "wan", true}),
                         [](const auto& tested) { return std::string(tested.param.name); });

}  // namespace
}  // namespace comap
