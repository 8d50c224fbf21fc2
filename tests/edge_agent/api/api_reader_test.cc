#include "edge_agent/api/api_reader.h"

#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

namespace comap {
namespace {

using namespace robot_api;
using std::chrono::milliseconds;
using std::chrono::seconds;

std::shared_ptr<const TileSnapshot> snapshotOf(uint64_t number, int tiles, int surfels) {
  auto snapshot = std::make_shared<TileSnapshot>();
  snapshot->number = number;
  snapshot->map = "m";
  for (int i = 0; i < tiles; ++i) {
    Tile tile;
    tile.key = {"m", i, 0, 0};
    tile.revision = number;
    tile.surfels.resize(static_cast<size_t>(surfels));
    snapshot->tiles.push_back(std::make_shared<const Tile>(std::move(tile)));
  }
  return snapshot;
}

class ApiReaderTest : public testing::Test {
 protected:
  void SetUp() override {
    std::array<int, 2> ends{};
    ASSERT_EQ(socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends.data()), 0);
    program_ = ends[1];
    reader_.emplace(ends[0], Greeting{}, now_);
    state_.tiles = snapshotOf(1, 0, 0);
    work();
    EXPECT_EQ(next(), Kind::kGreeting);
  }
  void TearDown() override { hangUp(); }
  void hangUp() {
    if (program_ >= 0) close(program_);
    program_ = -1;
  }
  void work() { reader_->work(state_, now_); }
  void send(const std::string& bytes) {
    ASSERT_EQ(::send(program_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  // The next message that has come, without waiting; nothing if it is not there as a whole.
  std::optional<Kind> next() {
    std::array<uint8_t, 4096> part{};
    for (ssize_t n = 0; (n = recv(program_, part.data(), part.size(), 0)) > 0;)
      come_.insert(come_.end(), part.begin(), part.begin() + n);
    if (come_.size() < kHeaderBytes) return std::nullopt;
    std::array<uint8_t, kHeaderBytes> head{};
    std::copy_n(come_.begin(), kHeaderBytes, head.begin());
    const auto header = decodeHeader(head, kMaxAnswerBytes);
    if (!header || come_.size() < kHeaderBytes + header->body_bytes) return std::nullopt;
    const auto end = come_.begin() + static_cast<ssize_t>(kHeaderBytes + header->body_bytes);
    body_.assign(come_.begin() + kHeaderBytes, end);
    come_.erase(come_.begin(), end);
    return static_cast<Kind>(header->kind);
  }
  bool hungUp() const {
    char byte = 0;
    const ssize_t n = recv(program_, &byte, 1, MSG_PEEK);
    return n == 0 || (n < 0 && errno == ECONNRESET);  // the second if it had said more than was read
  }

  int program_ = -1;
  ApiReader::Clock::time_point now_{seconds(1000)};
  std::optional<ApiReader> reader_;
  ApiState state_;
  std::vector<uint8_t> come_, body_;
};

TEST_F(ApiReaderTest, AnswersAPoseAtOnceOrWhenOneComesOrNotAtAll) {
  send(encode(AskPose{0, 0}));
  work();
  EXPECT_EQ(next(), Kind::kNothing) << "none is known yet, and it would not wait";
  state_.pose.sequence = 5;
  send(encode(AskPose{0, 0}));
  work();
  EXPECT_EQ(next(), Kind::kPose);
  EXPECT_EQ(decodePose(body_)->sequence, 5u);
  send(encode(AskPose{5, 100}));
  work();
  EXPECT_EQ(next(), std::nullopt);
  EXPECT_FALSE(reader_->wantsToRead()) << "one question at a time";
  EXPECT_EQ(reader_->due(), now_ + milliseconds(100));
  state_.pose.sequence = 8;
  work();
  EXPECT_EQ(next(), Kind::kPose);
  EXPECT_EQ(decodePose(body_)->sequence, 8u);
  send(encode(AskPose{8, 100}));
  work();
  now_ += milliseconds(100);
  work();
  EXPECT_EQ(next(), Kind::kNothing);
  EXPECT_TRUE(reader_->wantsToRead());
}

TEST_F(ApiReaderTest, AnAnswerIsOfOneSnapshotAlthoughTilesChangeMeanwhile) {
  state_.tiles = snapshotOf(1, 40, 2000);  // 1.1 MB, more than a socket takes at once
  send(encode(AskSurfels{{-1, -1, -1}, {100, 1, 1}, 0, 1'000'000}));
  work();
  state_.tiles = snapshotOf(2, 3, 1);
  ASSERT_EQ(next(), Kind::kSurfels);
  const auto head = decodeSurfelsHead(body_);
  EXPECT_EQ(head->snapshot, 1u);
  EXPECT_EQ(head->tiles, 40u);
  EXPECT_EQ(head->surfels, 80'000u);
  int tiles = 0;
  for (int turn = 0; turn < 1000 && tiles < 40; ++turn) {
    work();
    for (auto kind = next(); kind; kind = next()) {
      ASSERT_EQ(kind, Kind::kTile);
      const auto tile = decodeTile(body_);
      EXPECT_EQ(tile->revision, 1u);
      EXPECT_EQ(tile->key.x, tiles++);
    }
  }
  EXPECT_EQ(tiles, 40);
  send(encode(AskSurfels{{-1, -1, -1}, {100, 1, 1}, 1, 1'000'000}));
  work();
  ASSERT_EQ(next(), Kind::kSurfels);
  EXPECT_EQ(decodeSurfelsHead(body_)->snapshot, 2u);
}

TEST_F(ApiReaderTest, OnlyTilesThatTheBoxTouchesAreSent) {
  state_.tiles = snapshotOf(4, 10, 1);
  send(encode(AskSurfels{{1.1, 0.1, 0.1}, {1.9, 0.2, 0.2}, 0, 10}));
  work();
  ASSERT_EQ(next(), Kind::kSurfels);
  EXPECT_EQ(decodeSurfelsHead(body_)->tiles, 2u);
  ASSERT_EQ(next(), Kind::kTile);
  EXPECT_EQ(decodeTile(body_)->key.x, 2);
  ASSERT_EQ(next(), Kind::kTile);
  EXPECT_EQ(decodeTile(body_)->key.x, 3);
  send(encode(AskSurfels{{-1, -1, -1}, {100, 1, 1}, 4, 10}));
  work();
  EXPECT_EQ(next(), Kind::kUnchanged);
  send(encode(AskSurfels{{-1, -1, -1}, {100, 1, 1}, 0, 9}));
  work();
  ASSERT_EQ(next(), Kind::kRefusal);
  EXPECT_EQ(decodeRefusal(body_)->code, -4);
  EXPECT_NE(decodeRefusal(body_)->sentence.find("hold 10 surfels"), std::string::npos);
  send(encode(AskPose{0, 0}));
  work();
  EXPECT_EQ(next(), Kind::kNothing) << "and the connection goes on";
}

TEST_F(ApiReaderTest, WhoTakesNothingIsLeftAfterAWhileAndCostsLittleUntilThen) {
  state_.tiles = snapshotOf(1, 1000, 2000);  // 28 MB
  send(encode(AskSurfels{{-1, -1, -1}, {1000, 1, 1}, 0, 10'000'000}));
  for (int i = 0; i < 10; ++i) work();
  EXPECT_TRUE(reader_->wantsToWrite());
  now_ += ApiReader::kPatience - milliseconds(1);
  work();
  EXPECT_TRUE(reader_->isOpen());
  EXPECT_EQ(*reader_->due(), now_ + milliseconds(1));
  now_ += milliseconds(1);
  work();
  EXPECT_FALSE(reader_->isOpen());
  EXPECT_NE(reader_->reproach().find("10 s"), std::string::npos);
}

TEST_F(ApiReaderTest, WhoTakesSlowlyIsServed) {
  state_.tiles = snapshotOf(1, 200, 1000);  // 2.8 MB
  send(encode(AskSurfels{{-1, -1, -1}, {1000, 1, 1}, 0, 10'000'000}));
  std::vector<char> part(64 << 10);
  size_t taken = 0;
  for (int i = 0; i < 200 && taken < 2'805'000; ++i) {
    work();
    ASSERT_TRUE(reader_->isOpen());
    if (const ssize_t n = recv(program_, part.data(), part.size(), 0); n > 0) taken += static_cast<size_t>(n);
    now_ += seconds(5);
  }
  EXPECT_GE(taken, 2'805'000u);
}

TEST_F(ApiReaderTest, RubbishIsRefusedWithASentenceAndEndsTheConnection) {
  send("GET / HTTP/1.1\r\nHost: robot\r\n\r\n");
  work();
  ASSERT_EQ(next(), Kind::kRefusal);
  EXPECT_EQ(decodeRefusal(body_)->code, -3);
  EXPECT_NE(decodeRefusal(body_)->sentence.find("length"), std::string::npos);
  EXPECT_FALSE(reader_->isOpen());
  EXPECT_TRUE(hungUp());
  EXPECT_FALSE(reader_->reproach().empty());
}

TEST_F(ApiReaderTest, AnAnswerAsQuestionIsRefused) {
  send(encodeNothing());
  work();
  EXPECT_EQ(next(), Kind::kRefusal);
  EXPECT_FALSE(reader_->isOpen());
}

TEST_F(ApiReaderTest, AQuestionThatComesByteByByteIsUnderstood) {
  state_.pose.sequence = 1;
  for (const char byte : encode(AskPose{0, 0})) {
    EXPECT_EQ(next(), std::nullopt);
    send(std::string(1, byte));
    work();
  }
  EXPECT_EQ(next(), Kind::kPose);
}

TEST_F(ApiReaderTest, ManyQuestionsAtOnceAreAnsweredInTurnsThatEnd) {
  state_.pose.sequence = 1;
  std::string questions;
  for (int i = 0; i < 50; ++i) questions += encode(AskPose{0, 0});
  send(questions);
  work();
  int answers = 0;
  while (next()) ++answers;
  EXPECT_GT(answers, 0);
  EXPECT_LT(answers, 50) << "others wait for their turn";
  // Called only when there is something to do, as a server does.
  int waiting = 0;
  while (ioctl(reader_->descriptor(), FIONREAD, &waiting) == 0 && (waiting > 0 || reader_->wantsToWrite())) work();
  while (next()) ++answers;
  EXPECT_EQ(answers, 50);
}

TEST_F(ApiReaderTest, WhoLeavesIsForgottenInWhateverState) {
  state_.tiles = snapshotOf(1, 1000, 2000);
  send(encode(AskSurfels{{-1, -1, -1}, {1000, 1, 1}, 0, 10'000'000}));
  work();
  hangUp();
  work();
  EXPECT_FALSE(reader_->isOpen());
  EXPECT_TRUE(reader_->reproach().empty());
}

}  // namespace
}  // namespace comap
