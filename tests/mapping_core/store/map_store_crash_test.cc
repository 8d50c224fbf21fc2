#include <sys/wait.h>

#include <csignal>

#include "tests/mapping_core/store/store_fixture.h"

namespace comap {
namespace {

class MapStoreCrashTest : public StoreTest {
 protected:
  // Writes for ever; says "i" through the pipe after the i-th keyframe, its pose and its edge are acknowledged.
  [[noreturn]] void writeForEver(int pipe) {
    auto store = create();
    if (!store) _exit(1);
    const auto known = store->keyframes();
    if (!known) _exit(2);
    // The last one may lack its pose and edge: all calls may be repeated.
    for (uint32_t i = known->empty() ? 0 : uint32_t(known->size() - 1);; ++i) {
      const auto added = store->addKeyframe(idOf(i), i, bytesOf(i, 20000 + i % 7 * 30000));
      if (!added) _exit(3);
      // Half of them without waiting for the disk: only a loss of power would tell.
      auto together = store->begin(i % 2 == 0 ? Durable::kWithNext : Durable::kAtOnce);
      if (!together) _exit(8);
      if (!store->setPoses("m", {{idOf(i), poseOf(i)}})) _exit(4);
      if (i > 0 && !store->addEdge({idOf(i - 1), idOf(i), EdgeKind::kOdometry, poseOf(i), matrixOf(i)})) _exit(5);
      if (!together->commit()) _exit(9);
      if (i % 10 == 9 && !store->setTiles(std::vector<Tile>{tileOf("m", 0, 0, 0, 5000, i)})) _exit(6);
      if (::write(pipe, &i, sizeof i) != sizeof i) _exit(7);
    }
  }

  // Kills a writer after some acknowledgements and a while; returns the last acknowledged number.
  uint32_t killWriter(uint32_t acknowledgements, unsigned delay_us) {
    int pipe[2];
    EXPECT_EQ(::pipe(pipe), 0);
    const pid_t child = fork();
    if (child == 0) {
      close(pipe[0]);
      writeForEver(pipe[1]);
    }
    close(pipe[1]);
    uint32_t last = 0, value = 0;
    for (uint32_t i = 0; i < acknowledgements && ::read(pipe[0], &value, sizeof value) == sizeof value; ++i)
      last = value;
    usleep(delay_us);
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status)) << "the writer ended by itself: " << WEXITSTATUS(status);
    while (::read(pipe[0], &value, sizeof value) == sizeof value) last = value;
    close(pipe[0]);
    return last;
  }

  static void expectAll(const MapStore& store, uint32_t last) {
    const auto keyframes = store.keyframes();
    ASSERT_TRUE(keyframes) << keyframes.error().text;
    ASSERT_GE(keyframes->size(), last + 1);
    for (uint32_t i = 0; i <= last; ++i) {
      ASSERT_EQ((*keyframes)[i].id, idOf(i));
      ASSERT_EQ((*keyframes)[i].map, "m");
      const auto bytes = store.encodedKeyframe(idOf(i));
      ASSERT_TRUE(bytes) << bytes.error().text;
      ASSERT_EQ(*bytes, bytesOf(i, 20000 + i % 7 * 30000));
    }
    const auto edges = store.edges();
    ASSERT_TRUE(edges);
    ASSERT_GE(edges->size(), last);
    if (last >= 9) {
      ASSERT_EQ(store.tiles("m")->size(), 1u);
    }
  }
};

TEST_F(MapStoreCrashTest, everythingAcknowledgedIsThereAfterKill9) {
  std::mt19937 engine(1);
  std::uniform_int_distribution<unsigned> delay_us(0, 4000);
  uint32_t last = 0;
  for (int round = 0; round < 12; ++round) {
    last = killWriter(6, delay_us(engine));
    ASSERT_GE(last, uint32_t(5 + 5 * round));
    if (round % 3 == 0) {  // a dead process's log, read without leave to write
      auto store = read();
      ASSERT_TRUE(store) << store.error().text;
      expectAll(*store, last);
    }
    if (round % 3 == 1) {
      auto store = create();
      ASSERT_TRUE(store) << store.error().text;
      expectAll(*store, last);
    }
  }
  auto store = create();
  ASSERT_TRUE(store);
  expectAll(*store, last);
}

TEST_F(MapStoreCrashTest, aStoreIsMadeWholeOrNotAtAll) {
  for (int round = 0; round < 30; ++round) {
    const pid_t child = fork();
    if (child == 0) {
      auto store = create();
      for (;;) pause();
    }
    usleep(unsigned(round) * 300);
    kill(child, SIGKILL);
    int status = 0;
    waitpid(child, &status, 0);
    auto store = create();
    ASSERT_TRUE(store) << "round " << round << ": " << store.error().text;
    ASSERT_TRUE(*store->addKeyframe(idOf(0), 0, bytesOf(0, 10)));
    for (const auto& entry : std::filesystem::directory_iterator(folder_)) std::filesystem::remove(entry);
  }
}

}  // namespace
}  // namespace comap
