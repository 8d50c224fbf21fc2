#include "edge_agent/api/api_reader.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <utility>

namespace comap {
namespace {

using namespace robot_api;

constexpr size_t kPieceBytes = 128 << 10;  // of a long answer, in memory at a time
constexpr int kTurn = 8;                   // pieces and questions

bool touches(const TileKey& key, const AskSurfels& box) {
  const std::array<int32_t, 3> at{key.x, key.y, key.z};
  for (size_t i = 0; i < 3; ++i) {
    // A surfel at the rim of a far cube may be rounded onto the next one's side.
    const double low = at[i] * double{kTileEdge_m}, slack = 1e-6 * (1 + std::abs(low));
    if (low - slack > box.max_m[i] || low + double{kTileEdge_m} + slack < box.min_m[i]) return false;
  }
  return true;
}

bool belongs(const Tile& tile, const AskSurfels& box) { return !tile.surfels.empty() && touches(tile.key, box); }

}  // namespace

ApiReader::ApiReader(int fd, const Greeting& greeting, Clock::time_point now) : fd_(fd), last_progress_(now) {
  say(encode(greeting));
}

ApiReader::ApiReader(ApiReader&& other) noexcept : fd_(-1) { *this = std::move(other); }

ApiReader& ApiReader::operator=(ApiReader&& other) noexcept {
  std::swap(fd_, other.fd_);
  in_ = std::move(other.in_);
  out_ = std::move(other.out_);
  written_ = other.written_;
  wait_ = other.wait_;
  answer_ = std::move(other.answer_);
  last_words_ = other.last_words_;
  last_progress_ = other.last_progress_;
  reproach_ = std::move(other.reproach_);
  return *this;
}

ApiReader::~ApiReader() { close(); }

void ApiReader::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
  out_.clear();
  written_ = 0;
  wait_.reset();
  answer_.reset();
}

// Tells the program why, as far as it listens, and ends.
void ApiReader::refuse(const std::string& reproach) {
  reproach_ = reproach;
  say(encode(Refusal{kBadData, reproach}));
  last_words_ = true;
}

void ApiReader::say(std::string frame) {
  if (!unsent()) {
    out_.clear();
    written_ = 0;
  }
  if (out_.empty())
    out_ = std::move(frame);
  else
    out_ += frame;
}

std::optional<ApiReader::Clock::time_point> ApiReader::due() const {
  if (wantsToWrite()) return last_progress_ + kPatience;
  if (wait_) return wait_->until;
  return std::nullopt;
}

void ApiReader::work(const ApiState& state, Clock::time_point now) {
  for (int left = kTurn; isOpen();) {
    if (unsent()) {
      if (!write(now)) return;
    } else if (last_words_) {
      close();
    } else if (wait_) {
      if (!answerWait(state, now)) return;
      last_progress_ = now;
    } else if (left-- == 0) {
      return;
    } else if (answer_) {
      if (continueAnswer()) last_progress_ = now;
    } else if (!readQuestion(state, now)) {
      return;
    }
  }
}

// False if no more can be written now.
bool ApiReader::write(Clock::time_point now) {
  const ssize_t n = ::send(fd_, out_.data() + written_, out_.size() - written_, MSG_NOSIGNAL | MSG_DONTWAIT);
  if (n > 0) {
    written_ += static_cast<size_t>(n);
    last_progress_ = now;
    return true;
  }
  if (n < 0 && errno == EINTR) return true;
  if (n < 0 && errno != EAGAIN && errno != EWOULDBLOCK) {
    close();
    return false;
  }
  if (now - last_progress_ < kPatience) return false;
  if (reproach_.empty()) reproach_ = "has taken nothing of its answer for " + std::to_string(kPatience.count()) + " s";
  close();
  return false;
}

// True if there was more to say.
bool ApiReader::continueAnswer() {
  const auto& tiles = answer_->snapshot->tiles;
  std::string piece;
  for (; answer_->next < tiles.size() && piece.size() < kPieceBytes; ++answer_->next)
    if (const Tile& tile = *tiles[answer_->next]; belongs(tile, answer_->box)) piece += encode(tile);
  const bool more = !piece.empty();
  if (more) say(std::move(piece));
  if (answer_->next == tiles.size()) answer_.reset();
  return more;
}

bool ApiReader::answerWait(const ApiState& state, Clock::time_point now) {
  if (state.pose.sequence > wait_->after)
    say(encode(state.pose));
  else if (now >= wait_->until)
    say(encodeNothing());
  else
    return false;
  wait_.reset();
  return true;
}

// Takes one question. False if it is not there as a whole yet.
bool ApiReader::readQuestion(const ApiState& state, Clock::time_point now) {
  for (;;) {
    size_t wanted = kHeaderBytes;
    if (in_.size() >= kHeaderBytes) {
      std::array<uint8_t, kHeaderBytes> bytes{};
      std::copy_n(in_.begin(), kHeaderBytes, bytes.begin());
      const auto header = decodeHeader(bytes, kMaxRequestBytes);
      if (!header) {
        refuse(header.error().text);
        return true;
      }
      wanted += header->body_bytes;
      if (in_.size() == wanted) {
        const std::string question = std::exchange(in_, {});
        const auto* body = reinterpret_cast<const uint8_t*>(question.data()) + kHeaderBytes;
        last_progress_ = now;
        take(header->kind, {body, header->body_bytes}, state, now);
        return true;
      }
    }
    std::array<char, kHeaderBytes + kMaxRequestBytes> bytes;
    const ssize_t n = ::recv(fd_, bytes.data(), wanted - in_.size(), MSG_DONTWAIT);
    if (n > 0) {
      in_.append(bytes.data(), static_cast<size_t>(n));
    } else if (n == 0 || (errno != EINTR && errno != EAGAIN && errno != EWOULDBLOCK)) {
      close();
      return false;
    } else if (errno != EINTR) {
      return false;
    }
  }
}

void ApiReader::take(uint16_t kind, std::span<const uint8_t> body, const ApiState& state, Clock::time_point now) {
  switch (static_cast<Kind>(kind)) {
    case Kind::kAskPose: {
      const auto ask = decodeAskPose(body);
      if (!ask) return refuse(ask.error().text);
      wait_ = Wait{ask->after, now + std::chrono::milliseconds(ask->timeout_ms)};
      return;
    }
    case Kind::kAskSurfels: {
      const auto ask = decodeAskSurfels(body);
      if (!ask) return refuse(ask.error().text);
      return beginAnswer(*ask, state);
    }
    default:
      return refuse("message of kind " + std::to_string(kind) + ", which is no question");
  }
}

void ApiReader::beginAnswer(const AskSurfels& ask, const ApiState& state) {
  const auto snapshot = state.tiles ? state.tiles : std::make_shared<const TileSnapshot>();
  if (ask.known_snapshot != 0 && ask.known_snapshot == snapshot->number) return say(encodeUnchanged(snapshot->number));
  SurfelsHead head{snapshot->number, 0, 0, snapshot->map};
  for (const auto& tile : snapshot->tiles) {
    if (!belongs(*tile, ask)) continue;
    ++head.tiles;
    head.surfels += tile->surfels.size();
  }
  if (head.surfels > ask.most_surfels)
    return say(encode(Refusal{kTooLarge, "the tiles in the box hold " + std::to_string(head.surfels) +
                                             " surfels, more than the " + std::to_string(ask.most_surfels) +
                                             " asked for at most; ask for a smaller box"}));
  say(encode(head));
  answer_ = Answer{snapshot, ask, 0};
}

}  // namespace comap
