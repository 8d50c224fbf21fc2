#include "protocol/codec/merge_record_codec.h"

#include <gmock/gmock.h>

#include "tests/protocol/codec/samples.h"

namespace comap {
namespace {

MergeRecord sample(samples::Random& random, int voters) {
  MergeRecord merge{static_cast<uint32_t>(random()),
                    samples::map(random),
                    samples::map(random),
                    samples::pose(random),
                    {"a", "b", "c"},
                    {},
                    static_cast<uint32_t>(random()),
                    voters % 2 == 0 ? std::string() : std::string("walls disagree")};
  for (; voters > 0; --voters) merge.voters.push_back(samples::id(random));
  return merge;
}

TEST(MergeRecordCodec, RoundTrip) {
  samples::Random random(1);
  for (int i = 0; i < 100; ++i) {
    const MergeRecord merge = sample(random, i % 7);
    const auto bytes = encodeMergeRecord(merge);
    ASSERT_TRUE(bytes) << bytes.error().text;
    const auto back = decodeMergeRecord(*bytes);
    ASSERT_TRUE(back) << back.error().text;
    EXPECT_EQ(back->number, merge.number);
    EXPECT_EQ(back->kept, merge.kept);
    EXPECT_EQ(back->absorbed, merge.absorbed);
    EXPECT_TRUE(samples::near(back->T_kept_absorbed, merge.T_kept_absorbed));
    EXPECT_EQ(back->robots, merge.robots);
    EXPECT_EQ(back->voters, merge.voters);
    EXPECT_EQ(back->keyframes_ingested, merge.keyframes_ingested);
    EXPECT_EQ(back->undone, merge.undone);
  }
}

TEST(MergeRecordCodec, RefusesWhatBreaksALimit) {
  samples::Random random(2);
  MergeRecord crowded = sample(random, 1), nameless = sample(random, 1), many = sample(random, 0);
  crowded.robots.assign(kMaxMergeRobots + 1, "a");
  nameless.voters[0].robot.clear();
  many.voters.assign(kMaxMergeVoters + 1, {"a", 0, 0});
  MergeRecord wordy = sample(random, 1);
  wordy.undone = std::string(kMaxTextBytes + 1, 'x');
  for (const MergeRecord& bad : {crowded, nameless, many, wordy}) EXPECT_FALSE(encodeMergeRecord(bad));
}

TEST(MergeRecordCodec, SurvivesHostileBytes) {
  samples::Random random(3);
  for (const int voters : {0, 1, 6}) {
    const auto bytes = encodeMergeRecord(sample(random, voters));
    ASSERT_TRUE(bytes);
    samples::abuse(random, *bytes, [](auto bad) { return static_cast<bool>(decodeMergeRecord(bad)); });
  }
}

}  // namespace
}  // namespace comap
