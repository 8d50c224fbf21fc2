#include "tests/scenes/building_graph.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <tuple>

namespace comap {
namespace {

constexpr double kStep_m = 0.25, kBlock_m = 6;  // between keyframes; between crossings
constexpr double kVisits = 3;                   // how often a corridor is walked on average
constexpr double kNear_m = 1.2, kNear_rad = 0.8;
constexpr int kNeighbours = 20;  // keyframes nearer in sequence are no closures

class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double uniform() { return std::uniform_real_distribution<double>(0, 1)(engine_); }
  size_t below(size_t n) { return std::uniform_int_distribution<size_t>(0, n - 1)(engine_); }
  Pose noisy(const Pose& truth, double metres, double radians) {
    Vector6d xi;
    for (int i = 0; i < 6; ++i) xi(i) = normal_(engine_) * (i < 3 ? metres : radians);
    return Pose::exp(xi) * truth;
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

Matrix6d informationOf(double metres, double radians) {
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(metres), Eigen::Vector3d::Constant(radians);
  return Matrix6d(sigma.cwiseAbs2().cwiseInverse().asDiagonal());
}

// Walks from crossing to crossing and never turns round; heading follows the way with a lag, the camera sways.
class Walker {
 public:
  Walker(int blocks, Dice& dice) : blocks_(blocks), dice_(dice) {
    x_ = static_cast<int>(dice.below(blocks_ + 1));
    y_ = static_cast<int>(dice.below(blocks_ + 1));
    direction_ = static_cast<int>(dice.below(4));
    turn();
    heading_ = angle();
    phase_ = 6 * dice.uniform();
  }
  Pose step() {
    along_ += kStep_m;
    if (along_ >= kBlock_m) {
      along_ -= kBlock_m;
      x_ += kDx[direction_];
      y_ += kDy[direction_];
      turn();
    }
    heading_ += 0.4 * std::remainder(angle() - heading_, 2 * std::numbers::pi);
    phase_ += 0.05;
    const double sway = 0.3 * std::sin(phase_);
    const Eigen::Vector3d position(kBlock_m * x_ + along_ * kDx[direction_] - sway * kDy[direction_],
                                   kBlock_m * y_ + along_ * kDy[direction_] + sway * kDx[direction_],
                                   1.2 + 0.1 * std::sin(1.7 * phase_));
    // z ahead, y down
    Eigen::Matrix3d axes;
    axes << std::sin(heading_), 0, std::cos(heading_), -std::cos(heading_), 0, std::sin(heading_), 0, -1, 0;
    return Pose(axes, position);
  }

 private:
  static constexpr int kDx[4] = {1, 0, -1, 0}, kDy[4] = {0, 1, 0, -1};
  double angle() const { return direction_ * std::numbers::pi / 2; }
  bool inside(int direction) const {
    const int x = x_ + kDx[direction], y = y_ + kDy[direction];
    return x >= 0 && y >= 0 && x <= blocks_ && y <= blocks_;
  }
  void turn() {
    const int ahead = direction_;
    do {
      direction_ = (ahead + 3 + static_cast<int>(dice_.below(3))) % 4;
    } while (!inside(direction_) && (inside(ahead) || inside((ahead + 1) % 4) || inside((ahead + 3) % 4)));
  }

  int blocks_;
  Dice& dice_;
  int x_, y_, direction_;
  double along_ = 0, heading_ = 0, phase_ = 0;
};

using Cell = std::tuple<int, int>;
Cell cellOf(const Pose& pose) {
  return {static_cast<int>(std::floor(pose.translation().x() / kNear_m)),
          static_cast<int>(std::floor(pose.translation().y() / kNear_m))};
}

bool near(const Pose& a, const Pose& b) {
  return (a.translation() - b.translation()).norm() < kNear_m && (a.inverse() * b).angle() < kNear_rad;
}

class Maker {
 public:
  explicit Maker(const BuildingOptions& options) : options_(options), dice_(options.seed) {}

  BuildingGraph make() {
    const double corridor_m = options_.keyframes * kStep_m / kVisits;
    const int blocks = std::max(2, static_cast<int>(std::lround(std::sqrt(corridor_m / (2 * kBlock_m)))));
    std::vector<Walker> walkers;
    for (int i = 0; i < options_.robots; ++i) walkers.emplace_back(blocks, dice_);
    for (int i = 0; i < options_.keyframes; ++i) {
      const int robot = i % options_.robots;
      auto& keyframe = graph_.keyframes.emplace_back();
      keyframe.id.robot = std::string(1, 'r').append(std::to_string(robot));
      keyframe.id.session = 1;
      keyframe.id.sequence = static_cast<uint32_t>(i / options_.robots);
      keyframe.T_map_cam = walkers[robot].step();
      connect(i);
      cells_[cellOf(graph_.keyframes[i].T_map_cam)].push_back(i);
    }
    return std::move(graph_);
  }

 private:
  void connect(int i) {
    auto& keyframe = graph_.keyframes[i];
    const int robots = options_.robots;
    if (i < robots) {
      keyframe.T_map_odometry = keyframe.T_map_cam;
      // Another robot's first keyframe hangs on robot 0's: a graph in one piece from the start.
      if (i > 0) addTrue(i, 0, EdgeKind::kOdometry);
      return;
    }
    addTrue(i, i - robots, EdgeKind::kOdometry);
    keyframe.T_map_odometry = graph_.keyframes[i - robots].T_map_odometry * keyframe.edges[0].T_from_to;
    for (int k = 2; k <= options_.covisible + 1 && i - k * robots >= 0; ++k)
      addTrue(i, i - k * robots, EdgeKind::kCovisibility);
    std::vector<int> seen;
    const auto [cx, cy] = cellOf(keyframe.T_map_cam);
    for (int x = cx - 1; x <= cx + 1; ++x)
      for (int y = cy - 1; y <= cy + 1; ++y)
        if (const auto cell = cells_.find({x, y}); cell != cells_.end())
          for (const int j : cell->second)
            if ((j % robots != i % robots || i / robots - j / robots > kNeighbours) &&
                near(keyframe.T_map_cam, graph_.keyframes[j].T_map_cam))
              seen.push_back(j);
    std::sort(seen.begin(), seen.end());
    std::shuffle(seen.begin(), seen.end(), shuffle_);
    int wanted = static_cast<int>(options_.closures);
    wanted += dice_.uniform() < options_.closures - wanted;
    for (int k = 0; k < std::min<int>(wanted, static_cast<int>(seen.size())); ++k) {
      if (dice_.uniform() < options_.false_share)
        addFalse(i);
      else
        addTrue(i, seen[k], kindOf(i, seen[k]));
    }
  }

  EdgeKind kindOf(int i, int j) const {
    return i % options_.robots == j % options_.robots ? EdgeKind::kLoop : EdgeKind::kInterRobot;
  }
  void add(int i, int j, EdgeKind kind, const Pose& T_from_to, bool is_false) {
    const bool odometry = kind == EdgeKind::kOdometry;
    const Matrix6d information = odometry ? informationOf(options_.sigma_odometry_m, options_.sigma_odometry_rad)
                                          : informationOf(options_.sigma_closure_m, options_.sigma_closure_rad);
    auto& to = graph_.keyframes[i];
    to.edges.push_back({graph_.keyframes[j].id, to.id, kind, T_from_to, information});
    to.edge_false.push_back(is_false);
    ++graph_.edges;
    graph_.false_edges += is_false;
  }
  Pose truth(int i, int j) const { return graph_.keyframes[j].T_map_cam.inverse() * graph_.keyframes[i].T_map_cam; }
  void addTrue(int i, int j, EdgeKind kind) {
    const bool odometry = kind == EdgeKind::kOdometry;
    add(i, j, kind,
        dice_.noisy(truth(i, j), odometry ? options_.sigma_odometry_m : options_.sigma_closure_m,
                    odometry ? options_.sigma_odometry_rad : options_.sigma_closure_rad),
        false);
  }
  // A look-alike place: claimed to be near, in truth metres away. The second of a pair says the same of the next
  // keyframe of both: as two views of one wrong room do.
  void addFalse(int i) {
    const int robots = options_.robots;
    if (options_.false_in_pairs && pair_next_ > 0 && i - pair_query_ <= 3 * robots && i > pair_query_ &&
        (i - pair_query_) % robots == 0) {
      const int j = pair_next_;
      const Pose between_queries = truth(i, pair_query_), between_candidates = truth(j, pair_candidate_);
      const Pose claimed = between_candidates.inverse() * pair_claim_ * between_queries;
      pair_next_ = 0;
      add(i, j, kindOf(i, j), dice_.noisy(claimed, options_.sigma_closure_m, options_.sigma_closure_rad), true);
      return;
    }
    for (int tries = 0; tries < 1000; ++tries) {
      const int j = static_cast<int>(dice_.below(i));
      const double apart =
          (graph_.keyframes[j].T_map_cam.translation() - graph_.keyframes[i].T_map_cam.translation()).norm();
      if (apart < 2.5 || j + robots >= i) continue;
      const Pose claim = dice_.noisy(Pose(), 0.2, 0.15);
      add(i, j, kindOf(i, j), claim, true);
      pair_query_ = i;
      pair_candidate_ = j;
      pair_claim_ = claim;
      pair_next_ = j + robots;
      return;
    }
  }

  BuildingOptions options_;
  Dice dice_;
  std::mt19937_64 shuffle_{options_.seed + 77};
  BuildingGraph graph_;
  std::map<Cell, std::vector<int>> cells_;
  int pair_query_ = 0, pair_candidate_ = 0, pair_next_ = 0;
  Pose pair_claim_;
};

}  // namespace

BuildingGraph makeBuildingGraph(const BuildingOptions& options) { return Maker(options).make(); }

}  // namespace comap
