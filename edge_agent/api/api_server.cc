#include "edge_agent/api/api_server.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace comap {
namespace {

using Clock = ApiReader::Clock;

constexpr int kNicer = 10;        // than the thread that tracks
constexpr size_t kMostNews = 20;  // lines that nobody has taken yet
constexpr std::chrono::milliseconds kNoDescriptors{200};

int untilDue(const std::vector<ApiReader>& readers, bool full, Clock::time_point now) {
  auto due = full ? now + kNoDescriptors : Clock::time_point::max();
  for (const ApiReader& reader : readers) due = std::min(due, reader.due().value_or(Clock::time_point::max()));
  if (due == Clock::time_point::max()) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(due - now).count();
  return static_cast<int>(std::clamp<decltype(left)>(left, 0, 60'000));
}

}  // namespace

Result<std::unique_ptr<ApiServer>> ApiServer::start(const ApiOptions& options, const robot_api::Greeting& greeting) {
  auto socket = ApiSocket::listen(options);
  if (!socket) return socket.error();
  const int bell = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (bell < 0) return Error{ErrorCode::kUnreachable, std::string("api.socket: no eventfd: ") + std::strerror(errno)};
  return std::unique_ptr<ApiServer>(new ApiServer(std::move(*socket), greeting, bell));
}

ApiServer::ApiServer(ApiSocket socket, const robot_api::Greeting& greeting, int bell)
    : socket_(std::move(socket)), greeting_(greeting), bell_(bell), thread_([this] { serve(); }) {}

ApiServer::~ApiServer() {
  stop_ = true;
  ::eventfd_write(bell_, 1);
  thread_.join();
  ::close(bell_);
  // Its name goes before the connections do: where it is still there, the agent did not come to its end.
  const ApiSocket gone(std::move(socket_));
}

void ApiServer::publish(ApiState state) {
  auto next = std::make_shared<const ApiState>(std::move(state));
  {
    const std::scoped_lock lock(mutex_);
    state_.swap(next);
  }
  ::eventfd_write(bell_, 1);
  // The old state, perhaps the last to hold its tiles, ends here outside of the lock.
}

std::vector<std::string> ApiServer::takeNews() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(news_, {});
}

void ApiServer::note(std::string line) {
  const std::scoped_lock lock(mutex_);
  if (news_.size() < kMostNews) news_.push_back(std::move(line));
}

// False if there is nothing left to let anybody in with.
bool ApiServer::letIn(Clock::time_point now) {
  const int fd = socket_.accept();
  if (fd < 0) return errno != EMFILE && errno != ENFILE && errno != ENOMEM && errno != ENOBUFS;
  ApiReader reader(fd, greeting_, now);
  if (readers_.size() < kMostReaders) {
    readers_.push_back(std::move(reader));
    return true;
  }
  const std::string sentence = "there are " + std::to_string(kMostReaders) + " readers already";
  const std::string farewell = robot_api::encode(robot_api::Refusal{robot_api::kUnreachable, sentence});
  note("api: a reader was turned away: " + sentence);
  (void)!::send(fd, farewell.data(), farewell.size(), MSG_NOSIGNAL);
  return true;
}

void ApiServer::serve() {
  ::setpriority(PRIO_PROCESS, 0, kNicer);  // of this thread alone, on Linux
  std::vector<pollfd> polled;
  bool failing = false;
  while (!stop_) {
    polled.assign({{bell_, POLLIN, 0}, {failing ? -1 : socket_.descriptor(), POLLIN, 0}});
    for (const ApiReader& reader : readers_)
      polled.push_back({reader.descriptor(),
                        static_cast<short>(reader.wantsToWrite()  ? POLLOUT
                                           : reader.wantsToRead() ? POLLIN
                                                                  : 0),
                        0});
    if (::poll(polled.data(), polled.size(), untilDue(readers_, failing, Clock::now())) < 0 && errno != EINTR) {
      note(std::string("api: ends: ") + std::strerror(errno));
      return;
    }
    // Told whatever is asked of poll(), so that who hangs up while waiting would be told of for ever.
    for (size_t i = 2; i < polled.size(); ++i)
      if ((polled[i].revents & (POLLHUP | POLLERR)) != 0) readers_[i - 2].leave();
    eventfd_t rung = 0;
    ::eventfd_read(bell_, &rung);
    const auto now = Clock::now();
    failing = (polled[1].revents & POLLIN) != 0 && !letIn(now);
    std::shared_ptr<const ApiState> state;
    {
      const std::scoped_lock lock(mutex_);
      state = state_;
    }
    for (ApiReader& reader : readers_) reader.work(*state, now);
    std::erase_if(readers_, [&](const ApiReader& reader) {
      if (reader.isOpen()) return false;
      if (!reader.reproach().empty()) note("api: a reader was disconnected: " + reader.reproach());
      return true;
    });
  }
}

}  // namespace comap
