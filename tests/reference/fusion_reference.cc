#include "tests/reference/fusion_reference.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace comap::reference {
namespace {

Eigen::Vector3f colourAt(const ColourImage& colour, int x, int y) {
  const Rgb c = colour.at(std::clamp(x, 0, colour.width() - 1), std::clamp(y, 0, colour.height() - 1));
  return {static_cast<float>(c.r), static_cast<float>(c.g), static_cast<float>(c.b)};
}

Eigen::Vector3f interpolated(const ColourImage& colour, const Eigen::Vector2f& at) {
  const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  const float a = at.x() - static_cast<float>(x), b = at.y() - static_cast<float>(y);
  return (1 - b) * ((1 - a) * colourAt(colour, x, y) + a * colourAt(colour, x + 1, y)) +
         b * ((1 - a) * colourAt(colour, x, y + 1) + a * colourAt(colour, x + 1, y + 1));
}

bool seesThrough(const View& view, const Image<float>& raw, int x, int y, float z, int needed) {
  int behind = 0;
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) {
      if (!raw.contains(x + dx, y + dy) || raw.at(x + dx, y + dy) == 0) continue;
      const float there = 1 / std::abs(raw.at(x + dx, y + dy));
      if (there - z <= std::max(0.01f, 3 * view.sigma(there))) return false;
      ++behind;
    }
  }
  return behind >= needed;
}

bool isHidden(const Image<float>& raw, int x, int y, float z) {
  for (int dy = -2; dy <= 2; dy += 2) {
    for (int dx = -2; dx <= 2; dx += 2) {
      if (!raw.contains(x + dx, y + dy) || raw.at(x + dx, y + dy) * z <= 1) return false;
    }
  }
  return true;
}

float framesOf(const Image<uint8_t>& hits, int x, int y) {
  return hits.empty() ? 1.0f : static_cast<float>(std::clamp(static_cast<int>(hits.at(x / 4, y / 4)), 1, 10));
}

void cover(const View& view, Image<uint8_t>& covered, const Image<Measurement>& measurements,
           const Eigen::Vector3f& position, const Eigen::Vector3f& normal, float radius, float gate) {
  const Eigen::Vector2f centre = view.project(position);
  const float reach = std::min(radius / position.z() * view.focal(), 8.0f);
  for (int y = 0; y < covered.height(); y += 2) {
    for (int x = 0; x < covered.width(); x += 2) {
      if (std::abs(static_cast<float>(x) - centre.x()) > reach ||
          std::abs(static_cast<float>(y) - centre.y()) > reach) {
        continue;
      }
      const Measurement& m = measurements.at(x, y);
      if (m.depth <= 0) continue;
      const Eigen::Vector3f offset = view.ray(static_cast<float>(x), static_cast<float>(y)) * m.depth - position;
      const float height = normal.dot(offset);
      const float lateral2 = offset.squaredNorm() - height * height;
      if (std::abs(height) < gate && lateral2 < 0.7f * radius * radius && normal.dot(m.normal) > 0.5f) {
        covered.at(x, y) = 1;
      }
    }
  }
}

void update(const View& view, Row& row, const Measurement& m, int x, int y, float frames, const ColourImage& colour) {
  const Eigen::Vector3f position = view.toCamera(row.position);
  const float radius = radiusOf(view, m.depth, m.normal.z());
  if (radius < 1.5f * row.radius) {
    const float weight = precisionOf(view, x, y, m.depth, frames);
    const float share = weight / (std::min(row.precision, view.parameters.averaging_limit) + weight);
    const Eigen::Vector3f seen = view.ray(static_cast<float>(x), static_cast<float>(y)) * m.depth;
    row.position += view.R_cam_map.transpose() * (m.normal * m.normal.dot(seen - position)) * share;
    row.normal = ((1 - share) * row.normal + share * (view.R_cam_map.transpose() * m.normal)).normalized();
    row.radius = (1 - share) * row.radius + share * radius;
    row.colour = (1 - share) * row.colour + share * interpolated(colour, view.project(position));
    row.precision += weight;
  }
  row.confidence += confidenceOf(frames);
  ++row.observations;
}

bool doubles(const View& view, const Row& row, const Row& other) {
  const Eigen::Vector3f offset = row.position - other.position;
  const float height = offset.dot(other.normal);
  const float reach = 0.6f * std::min(row.radius, other.radius);
  return offset.squaredNorm() - height * height < reach * reach &&
         std::abs(height) < view.gate(view.toCamera(row.position).z()) && row.normal.dot(other.normal) > 0.866f &&
         other.confidence >= row.confidence;
}

}  // namespace

Association associate(const View& view, const std::vector<Row>& rows, const Image<Measurement>& measurements,
                      const Image<float>& raw) {
  const int width = measurements.width(), height = measurements.height();
  Association result{std::vector<Match>(rows.size(), Match::kNone), std::vector<int>(rows.size(), -1),
                     Image<int>(width, height, -1), Image<uint8_t>(width, height, 0)};
  Image<uint32_t> ranks(width, height, std::numeric_limits<uint32_t>::max());
  for (size_t i = 0; i < rows.size(); ++i) {
    const Row& row = rows[i];
    const Eigen::Vector3f position = view.toCamera(row.position);
    if (row.confidence < 0 || position.z() <= 0.05f || position.z() >= view.parameters.depth_max_m + 1) continue;
    const Eigen::Vector2f at = view.project(position);
    const int x = static_cast<int>(std::floor(at.x() + 0.5f)), y = static_cast<int>(std::floor(at.y() + 0.5f));
    if (!raw.contains(x, y)) continue;
    result.pixels[i] = y * width + x;
    const Measurement& m = measurements.at(x, y);
    const Eigen::Vector3f normal = view.R_cam_map * row.normal;
    const Eigen::Vector3f ray = position / position.z();
    const float facing = -normal.dot(ray) / ray.norm();
    const bool in_range = position.z() > view.parameters.depth_min_m && position.z() < view.parameters.depth_max_m;
    float in_front = 0, gate = 0, above = 0;
    bool supported = false;
    if (m.depth > 0) {
      const Eigen::Vector3f seen = view.ray(static_cast<float>(x), static_cast<float>(y)) * m.depth;
      const float plane_depth = m.normal.dot(seen) / m.normal.dot(ray);
      in_front = (plane_depth - position.z()) * ray.norm();
      gate = view.gate(plane_depth);
      above = m.normal.dot(position - seen);
      supported = in_range && std::abs(in_front) < gate && normal.dot(m.normal) > 0.5f;
    }
    const bool stable = row.confidence >= view.parameters.stable_confidence;
    const bool close = !supported && m.depth > 0 && in_range && std::abs(above) < 0.035f &&
                       normal.dot(m.normal) > 0.866f && facing > 0.2f;
    if (close && stable) cover(view, result.covered, measurements, position, normal, row.radius, 0.035f);
    if (supported) {
      result.matches[i] = Match::kSupported;
      cover(view, result.covered, measurements, position, normal, row.radius, gate);
      if (normal.dot(m.normal) > 0.8775826f || !stable) {
        result.matches[i] = Match::kFits;
        const float dx = at.x() - static_cast<float>(x), dy = at.y() - static_cast<float>(y);
        const auto distance = static_cast<uint32_t>(std::min((dx * dx + dy * dy) * 508, 254.0f));
        const uint32_t rank = stable ? distance : 255 + distance;
        if (rank < ranks.at(x, y)) {
          ranks.at(x, y) = rank;
          result.winners.at(x, y) = static_cast<int>(i);
        }
      }
    } else if (raw.at(x, y) != 0 && 1 / std::abs(raw.at(x, y)) > position.z() &&
               seesThrough(view, raw, x, y, position.z(), std::abs(facing) > 0.2f ? 22 : 25)) {
      result.matches[i] = Match::kViolated;
    } else if (close && in_front < 0 && isHidden(raw, x, y, position.z())) {
      result.matches[i] = Match::kViolated;
    } else if (m.depth > 0 && in_range && facing > 0.2f && in_front > -gate) {
      result.matches[i] = Match::kMissed;
    }
  }
  return result;
}

FusionReport fuse(const View& view, std::vector<Row>& rows, const ColourImage& colour, const DepthImage& depth,
                  const Image<uint8_t>& depth_hits, uint32_t owner, uint32_t robot_bit) {
  const FusionParameters& p = view.parameters;
  const Image<float> raw = inverseDepth(depth, p);
  const Image<Measurement> measurements = measure(view, filterDepth(filterDepth(raw, false, p), true, p));
  const Association found = associate(view, rows, measurements, raw);
  FusionReport report;
  const int width = depth.width();
  const auto isWinner = [&](size_t i) { return found.winners.data()[found.pixels[i]] == static_cast<int>(i); };
  for (size_t i = 0; i < rows.size(); ++i) {
    const Match match = found.matches[i];
    if (match == Match::kNone) continue;
    Row& row = rows[i];
    const bool good = match == Match::kSupported || match == Match::kFits;
    row.misses = good ? 0 : std::min(row.misses + 1, 255u);
    if (match == Match::kViolated) row.violations = std::min(row.violations + 1, 255u);
    if (good && row.violations > 0) --row.violations;
    if (match == Match::kFits && isWinner(i)) {
      const int x = found.pixels[i] % width, y = found.pixels[i] / width;
      update(view, row, measurements.at(x, y), x, y, framesOf(depth_hits, x, y), colour);
      row.contributors |= robot_bit;
      ++report.updated;
    }
  }
  std::vector<bool> removed(rows.size(), false);
  for (size_t i = 0; i < rows.size(); ++i) {
    const Match match = found.matches[i];
    if (match == Match::kNone) continue;
    const bool unstable = rows[i].confidence < p.stable_confidence;
    const uint32_t patience = unstable ? 1 : std::clamp(rows[i].observations / 2, 2u, 5u);
    removed[i] = (match == Match::kViolated && rows[i].violations >= patience) ||
                 (unstable && rows[i].misses > p.unstable_timeout);
    const int winner = found.winners.data()[found.pixels[i]];
    if (!removed[i] && (match == Match::kSupported || match == Match::kFits) && winner >= 0 && !isWinner(i)) {
      removed[i] = doubles(view, rows[i], rows[static_cast<size_t>(winner)]);
    }
  }
  std::vector<Row> kept;
  for (size_t i = 0; i < rows.size(); ++i) {
    if (!removed[i]) kept.push_back(rows[i]);
  }
  report.removed = static_cast<uint32_t>(rows.size() - kept.size());
  for (int y = 0; y < depth.height(); y += 2) {
    for (int x = 0; x < width; x += 2) {
      const Measurement& m = measurements.at(x, y);
      if (m.depth <= 0 || found.covered.at(x, y)) continue;
      const int stride = strideOf(view, m.depth);
      if (x % stride != 0 || y % stride != 0) continue;
      Row& row = kept.emplace_back();
      row.position = view.toMap(view.ray(static_cast<float>(x), static_cast<float>(y)) * m.depth);
      row.normal = view.R_cam_map.transpose() * m.normal;
      const float frames = framesOf(depth_hits, x, y);
      row.confidence = confidenceOf(frames);
      row.radius = radiusOf(view, m.depth, m.normal.z());
      row.colour = colourAt(colour, x, y);
      row.owner = owner;
      row.contributors = robot_bit;
      row.observations = 1;
      row.precision = precisionOf(view, x, y, m.depth, frames);
      ++report.inserted;
    }
  }
  rows = std::move(kept);
  report.total = static_cast<uint32_t>(rows.size());
  return report;
}

}  // namespace comap::reference
