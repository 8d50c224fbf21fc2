#include "mapping_core/merge/standing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "mapping_core/merge/canonical_poses.h"

namespace comap {
namespace {

KeyframeId idOf(char robot, uint32_t sequence) { return {std::string(1, robot), 1, sequence}; }

Pose poseOf(double x, double y, double turn_rad) {
  return Pose(Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ())), Eigen::Vector3d(x, y, 0));
}

// Robots a, b, c ... of five keyframes, each walking along x in a world where it starts 1 m beside the one before.
class Fleet {
 public:
  explicit Fleet(int robots) {
    std::mt19937 engine(3);
    std::normal_distribution<double> noise(0, 0.002);
    for (int r = 0; r < robots; ++r)
      for (uint32_t i = 0; i < 5; ++i) {
        const char robot = static_cast<char>('a' + r);
        keyframes.push_back(idOf(robot, i));
        if (i > 0)
          add(idOf(robot, i - 1), idOf(robot, i), EdgeKind::kOdometry, 0, poseOf(noise(engine), noise(engine), 0));
      }
  }
  static Pose truth(const KeyframeId& id) {
    return poseOf(0.3 * id.sequence, id.robot[0] - 'a', 0.1 * id.sequence + 0.2 * (id.robot[0] - 'a'));
  }
  void add(const KeyframeId& from, const KeyframeId& to, EdgeKind kind, uint32_t merge, const Pose& error = Pose()) {
    edges.push_back({from, to, kind, truth(from).inverse() * truth(to) * error, Matrix6d::Identity() * 1e4, merge});
  }
  void close(const KeyframeId& from, const KeyframeId& to, uint32_t merge = 0) {
    add(from, to, EdgeKind::kInterRobot, merge);
  }
  // Two closures and the record of what they did.
  void merge(char a, char b) {
    const auto number = static_cast<uint32_t>(merges.size() + 1);
    for (uint32_t i = 1; i < 3; ++i) close(idOf(a, i), idOf(b, i), number);
    record({idOf(b, 1), idOf(b, 2)});
  }
  void record(std::vector<KeyframeId> voters) {
    MergeRecord record;
    record.number = static_cast<uint32_t>(merges.size() + 1);
    record.voters = std::move(voters);
    merges.push_back(record);
  }
  Standing standing() const { return standingOf(keyframes, edges, merges, 2); }

  std::vector<KeyframeId> keyframes;
  std::vector<Edge> edges;
  std::vector<MergeRecord> merges;
};

std::vector<KeyframeId> anchorsOf(const std::string& robots) {
  std::vector<KeyframeId> anchors;
  for (const char robot : robots) anchors.push_back(idOf(robot, 0));
  return anchors;
}

TEST(Standing, OdometryMakesMapsAndMergesJoinThem) {
  Fleet fleet(3);
  EXPECT_EQ(fleet.standing().components.anchors(), anchorsOf("abc"));
  fleet.merge('a', 'b');
  fleet.merge('b', 'c');
  const Standing standing = fleet.standing();
  EXPECT_EQ(standing.components.anchors(), anchorsOf("a"));
  EXPECT_EQ(standing.edges.size(), 12u + 4u);
  EXPECT_TRUE(standing.apart.empty());
  ASSERT_EQ(standing.joins.size(), 2u);
  EXPECT_EQ(standing.joins[1].merge, 2u);
  EXPECT_EQ(standing.joins[1].closures.size(), 2u);
}

TEST(Standing, UndoingTakesEveryEdgeBetweenTheSidesWithIt) {
  Fleet fleet(3);
  fleet.merge('a', 'b');
  fleet.merge('b', 'c');
  fleet.close(idOf('a', 3), idOf('b', 3));  // loops of the joint map
  fleet.close(idOf('a', 4), idOf('c', 4));
  fleet.close(idOf('b', 4), idOf('c', 3));
  fleet.merges[0].undone = "a test";
  const Standing standing = fleet.standing();
  EXPECT_EQ(standing.components.anchors(), anchorsOf("ab"));
  EXPECT_TRUE(standing.components.together(idOf('b', 0), idOf('c', 0)));
  EXPECT_EQ(standing.apart.size(), 2u + 2u) << "its closures, and the loops a-b and a-c";
  EXPECT_TRUE(standing.unsupported.empty());
  for (const Edge& edge : standing.apart) EXPECT_EQ(edge.from.robot, "a");
}

TEST(Standing, ALaterMergeGoesWithTheSideThatMostOfItsClosuresAreOf) {
  for (const bool enough : {true, false}) {
    Fleet fleet(3);
    fleet.merge('a', 'b');
    fleet.close(idOf('a', 4), idOf('c', 0), 2);
    fleet.close(idOf('b', 4), idOf('c', 4), 2);
    if (enough) fleet.close(idOf('b', 3), idOf('c', 2), 2);
    fleet.record({idOf('c', 0), idOf('c', 4), idOf('c', 2)});
    EXPECT_EQ(fleet.standing().components.anchors(), anchorsOf("a"));
    fleet.merges[0].undone = "a test";
    const Standing standing = fleet.standing();
    EXPECT_EQ(standing.components.anchors(), enough ? anchorsOf("ab") : anchorsOf("abc"));
    EXPECT_EQ(standing.unsupported, enough ? std::vector<uint32_t>{} : std::vector<uint32_t>{2});
    EXPECT_EQ(standing.apart.size(), enough ? 3u : 4u);
  }
}

TEST(Standing, ASingleVoteIsEnoughWhereItWasEnoughBefore) {
  Fleet fleet(2);
  fleet.close(idOf('a', 1), idOf('b', 1), 1);
  fleet.record({idOf('b', 1)});
  EXPECT_EQ(fleet.standing().components.anchors(), anchorsOf("a"));
  fleet.merges[0].voters.push_back(idOf('b', 2));  // there were two: one of them is gone
  EXPECT_EQ(fleet.standing().components.anchors(), anchorsOf("ab"));
}

TEST(Standing, DamagedRecordsJoinNothing) {
  Fleet fleet(2);
  fleet.close(idOf('a', 1), idOf('z', 1), 7);
  fleet.edges.push_back({idOf('b', 1), idOf('a', 3), EdgeKind::kOdometry, {}, {}, 0});
  const Standing standing = fleet.standing();
  EXPECT_EQ(standing.components.anchors(), anchorsOf("ab"));
  EXPECT_EQ(standing.apart.size(), 2u);
}

std::set<KeyframeId> setOf(const std::vector<KeyframeId>& ids) { return {ids.begin(), ids.end()}; }

bool identical(const Pose& a, const Pose& b) {
  return a.translation() == b.translation() && a.rotation().coeffs() == b.rotation().coeffs();
}

TEST(CanonicalPoses, DoNotDependOnTheOrderOfArrival) {
  Fleet fleet(3);
  fleet.merge('b', 'c');
  fleet.merge('a', 'b');
  fleet.close(idOf('a', 4), idOf('c', 4));
  const Standing first = fleet.standing();
  const auto expected = canonicalPoses(first, setOf(anchorsOf("a")), {});
  ASSERT_TRUE(expected) << expected.error().text;
  ASSERT_EQ(expected->size(), 15u);
  for (const auto& [id, T] : *expected) {
    const Pose error = (Fleet::truth(idOf('a', 0)).inverse() * Fleet::truth(id)).inverse() * T;
    EXPECT_LT(error.translation().norm(), 0.02) << toString(id);
  }
  std::mt19937 engine(1);
  for (int round = 0; round < 5; ++round) {
    std::shuffle(fleet.keyframes.begin(), fleet.keyframes.end(), engine);
    std::shuffle(fleet.edges.begin(), fleet.edges.end(), engine);
    const Standing standing = fleet.standing();
    const auto poses = canonicalPoses(standing, setOf(anchorsOf("a")), {});
    ASSERT_TRUE(poses) << poses.error().text;
    for (const auto& [id, T] : *poses) EXPECT_TRUE(identical(T, expected->at(id))) << toString(id);
  }
}

TEST(CanonicalPoses, AreThoseOfTheMapsAloneWhenTheMergeIsUndone) {
  Fleet alone(3), fleet(3);
  for (Fleet* one : {&alone, &fleet}) {
    one->merge('b', 'c');
    one->add(idOf('b', 0), idOf('b', 4), EdgeKind::kLoop, 0);
  }
  fleet.merge('a', 'c');
  fleet.close(idOf('a', 4), idOf('b', 4));
  const auto joint = canonicalPoses(fleet.standing(), setOf(anchorsOf("a")), {});
  ASSERT_TRUE(joint);
  fleet.merges[1].undone = "a test";
  const Standing parted = fleet.standing(), never = alone.standing();
  ASSERT_EQ(parted.components.anchors(), anchorsOf("ab"));
  const auto poses = canonicalPoses(parted, setOf(anchorsOf("ab")), {});
  const auto expected = canonicalPoses(never, setOf(anchorsOf("ab")), {});
  ASSERT_TRUE(poses && expected);
  for (const auto& [id, T] : *expected) EXPECT_TRUE(identical(T, poses->at(id))) << toString(id);
  const auto only_b = canonicalPoses(parted, {idOf('b', 0)}, {});
  ASSERT_TRUE(only_b);
  EXPECT_EQ(only_b->size(), 10u);
  for (const auto& [id, T] : *only_b) EXPECT_TRUE(identical(T, poses->at(id))) << "maps do not touch each other";
  EXPECT_FALSE(identical(joint->at(idOf('c', 4)), poses->at(idOf('c', 4))));

  fleet.merges[1].undone.clear();
  const auto again = canonicalPoses(fleet.standing(), setOf(anchorsOf("a")), {});
  ASSERT_TRUE(again);
  for (const auto& [id, T] : *joint) EXPECT_TRUE(identical(T, again->at(id))) << toString(id);
}

}  // namespace
}  // namespace comap
