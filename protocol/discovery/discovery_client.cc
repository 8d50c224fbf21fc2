#include "protocol/discovery/discovery_client.h"

#include <atomic>
#include <mutex>
#include <utility>

namespace comap {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr seconds kSilent{6};  // three announcements without an answer
constexpr seconds kResolveEvery{5};

// The resolver may hold who asks it for many seconds, also one who wants to end: it is asked from a thread that nobody
// waits for.
class Lookup {
 public:
  void start(const std::string& host) {
    state_ = std::make_shared<State>();
    std::thread([host, state = state_] {
      state->address = resolve(host);
      state->done = true;
    }).detach();
  }
  bool running() const { return state_ && !state_->done; }
  std::optional<uint32_t> take() {
    if (!state_ || !state_->done) return std::nullopt;
    return std::exchange(state_, nullptr)->address;
  }

 private:
  struct State {
    std::optional<uint32_t> address;
    std::atomic<bool> done = false;
  };
  std::shared_ptr<State> state_;
};

}  // namespace

class DiscoveryClient::Work {
 public:
  Work(DiscoveryClientOptions options, HostPort server, uint32_t interface, DatagramSocket socket)
      : options_(std::move(options)),
        server_(std::move(server)),
        interface_(interface),
        socket_(std::move(socket)),
        site_(siteCode(options_.domain, options_.site)) {
    if (const auto address = parseAddress(server_.host)) endpoint_ = Endpoint{*address, server_.port, 0};
  }

  uint16_t port() const { return socket_.port(); }
  void follow(const ParticipantPrefix& participant) {
    const std::lock_guard lock(mutex_);
    participant_ = participant;
  }
  std::string trouble() const {
    const std::lock_guard lock(mutex_);
    return trouble_.value_or("");
  }
  void stop() {
    stop_ = true;
    socket_.wake();
  }

  void run() {
    heard_ = Clock::now();
    while (!stop_) {
      findServer();
      Endpoint from;
      if (const auto bytes = socket_.receive(milliseconds(200), from)) {
        if (from.address == interface_ && isOwn(*bytes)) {
          announcement_ = *bytes;
          cookie_tried_ = false;
          announce(NoteKind::kAnnounce);
        } else if (endpoint_ && isSameHostPort(from, *endpoint_)) {
          if (const auto note = decodeNote(*bytes)) takeNote(*note);
        }
      }
      noticeSilence();
    }
    if (endpoint_) announce(NoteKind::kLeave);
  }

 private:
  bool isOwn(const std::vector<uint8_t>& bytes) const {
    const auto sender = senderOf(bytes);
    const std::lock_guard lock(mutex_);
    return sender && participant_ == sender && bytes.size() <= kMostAnnouncementBytes && isAnnouncement(bytes);
  }

  void findServer() {
    const auto now = Clock::now();
    if (lookup_.running()) return;
    if (const auto address = lookup_.take()) {
      const Endpoint found{*address, server_.port, 0};
      if (endpoint_ != found) cookie_ = {};
      endpoint_ = found;
      if (!announcement_.empty()) announce(NoteKind::kAnnounce);
    }
    const bool by_name = !parseAddress(server_.host);
    if (!by_name || (endpoint_ && now - heard_ < kSilent) || now - asked_ < kResolveEvery) return;
    asked_ = now;
    lookup_.start(server_.host);
  }

  void announce(NoteKind kind) {
    if (!endpoint_) return;
    Note note;
    note.kind = kind;
    note.role = options_.role;
    note.cookie = cookie_;
    note.site = site_;
    if (kind == NoteKind::kAnnounce) note.announcement = announcement_;
    socket_.send(*endpoint_, encodeNote(note));
  }

  void takeNote(const Note& note) {
    if (note.site != site_) return;
    switch (note.kind) {
      case NoteKind::kCookie:
        // Once for each announcement: a server that always wants another would keep both busy.
        cookie_ = note.cookie;
        if (std::exchange(cookie_tried_, true)) return;
        announce(NoteKind::kAnnounce);
        return;
      case NoteKind::kWelcome:
        heard_ = Clock::now();
        setTrouble("", "answers; " + std::to_string(note.count) + " others of site " + options_.site + " are there");
        return;
      case NoteKind::kFull:
        heard_ = Clock::now();
        setTrouble("has no room for more participants", "has no room for more participants; trying on");
        return;
      case NoteKind::kIntroduce:
        if (const auto port = announcedPort(announcement_); port && isAnnouncement(note.announcement))
          socket_.send({interface_, *port, 0}, note.announcement);
        return;
      default:
        return;
    }
  }

  void noticeSilence() {
    if (Clock::now() - heard_ < kSilent) return;
    const std::string what =
        endpoint_ ? "does not answer: is it running there ('fleet discovery'), and UDP not blocked?"
                  : "cannot be found: this machine's resolver does not know the name '" + server_.host + "'";
    setTrouble(what, what + " Trying on");
  }

  // Told once for each kind of trouble, and when it is over.
  void setTrouble(const std::string& trouble, const std::string& line) {
    const std::string server = "discovery server " + server_.host + ":" + std::to_string(server_.port) + " ";
    {
      const std::lock_guard lock(mutex_);
      const std::string now = trouble.empty() ? "" : server + trouble;
      if (trouble_ == now) return;
      trouble_ = now;
    }
    if (options_.notice) options_.notice(server + line);
  }

  const DiscoveryClientOptions options_;
  const HostPort server_;
  const uint32_t interface_;
  const DatagramSocket socket_;
  const SiteCode site_;
  std::atomic<bool> stop_ = false;
  // Of the thread alone.
  std::optional<Endpoint> endpoint_;
  Lookup lookup_;
  Clock::time_point heard_, asked_{};
  Cookie cookie_{};
  bool cookie_tried_ = false;
  std::vector<uint8_t> announcement_;
  mutable std::mutex mutex_;  // what follows
  std::optional<ParticipantPrefix> participant_;
  std::optional<std::string> trouble_;  // empty: the server answers; nothing: not known yet
};

Result<std::unique_ptr<DiscoveryClient>> DiscoveryClient::start(DiscoveryClientOptions options) {
  auto server = parseHostPort(options.server, "link.discovery_server");
  if (!server) return server.error();
  const auto interface = parseAddress(options.interface);
  if (!interface)
    return Error{ErrorCode::kWrongUse, "link.interface_address '" + options.interface + "' is no IPv4 address"};
  auto socket = DatagramSocket::bind({*interface, 0, 0});
  if (!socket) return socket.error();
  return std::unique_ptr<DiscoveryClient>(new DiscoveryClient(
      std::make_unique<Work>(std::move(options), std::move(*server), *interface, std::move(*socket))));
}

DiscoveryClient::DiscoveryClient(std::unique_ptr<Work> work)
    : work_(std::move(work)), thread_([this] { work_->run(); }) {}

DiscoveryClient::~DiscoveryClient() {
  work_->stop();
  thread_.join();
}

uint16_t DiscoveryClient::port() const { return work_->port(); }
void DiscoveryClient::follow(const ParticipantPrefix& participant) { work_->follow(participant); }
std::string DiscoveryClient::trouble() const { return work_->trouble(); }

}  // namespace comap
