#include "fleet_tools/evaluate/metrics_trajectory.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <tuple>

#include "edge_agent/capture/stamp.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr uintmax_t kMaxFile_bytes = uintmax_t{256} << 20;

Error badLine(const std::string& path, size_t line, const std::string& text) {
  return {ErrorCode::kBadData, path + ":" + std::to_string(line) + ": " + text};
}

Result<StampedPose> parseLine(const std::string& path, size_t number, const std::string& text) {
  constexpr const char* kNames[] = {"tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  std::istringstream line(text);
  std::vector<std::string> words;
  for (std::string word; words.size() < 9 && line >> word;) words.push_back(word);
  if (words.size() != 8) {
    return badLine(path, number,
                   std::string("has ") + (words.size() > 8 ? "more than 8" : std::to_string(words.size())) +
                       " words, expected 8 (timestamp tx ty tz qx qy qz qw)");
  }
  const auto stamp_ns = parseStamp_ns(words[0]);
  if (!stamp_ns) return badLine(path, number, "timestamp '" + words[0] + "' is not a decimal number of seconds");
  double values[7];
  for (size_t i = 0; i < 7; ++i) {
    const auto& word = words[i + 1];
    const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), values[i]);
    if (problem != std::errc{} || end != word.data() + word.size() || !std::isfinite(values[i])) {
      return badLine(path, number, std::string(kNames[i]) + " is '" + word + "', not a finite number");
    }
  }
  const Eigen::Quaterniond rotation(values[6], values[3], values[4], values[5]);
  if (std::abs(rotation.norm() - 1) > 0.02) {
    return badLine(path, number, "quaternion has length " + std::to_string(rotation.norm()) + ", expected 1");
  }
  return StampedPose{*stamp_ns, Pose(rotation, Eigen::Vector3d(values[0], values[1], values[2]))};
}

}  // namespace

Result<std::vector<StampedPose>> readTrajectory(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::error_code problem;
  const auto size = std::filesystem::file_size(path, problem);
  if (problem) return Error{ErrorCode::kUnreachable, path + ": cannot be read: " + problem.message()};
  if (size > kMaxFile_bytes) return Error{ErrorCode::kBadData, path + ": is larger than 256 MiB"};
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be opened"};
  std::vector<StampedPose> trajectory;
  std::string text;
  for (size_t number = 1; std::getline(file, text); ++number) {
    const size_t start = text.find_first_not_of(" \t\r");
    if (start == std::string::npos || text[start] == '#') continue;
    auto pose = parseLine(path, number, text);
    if (!pose) return pose.error();
    if (!trajectory.empty() && pose->stamp_ns <= trajectory.back().stamp_ns) {
      return badLine(path, number, "timestamp " + formatStamp(pose->stamp_ns) + " is not later than the one before");
    }
    trajectory.push_back(*pose);
  }
  if (trajectory.empty()) return Error{ErrorCode::kBadData, path + ": holds no pose"};
  return trajectory;
}

std::vector<PosePair> associate(const std::vector<StampedPose>& estimate, const std::vector<StampedPose>& truth) {
  std::vector<std::tuple<int64_t, size_t, size_t>> candidates;
  size_t start = 0;
  for (size_t e = 0; e < estimate.size(); ++e) {
    const int64_t stamp = estimate[e].stamp_ns;
    while (start < truth.size() && truth[start].stamp_ns < stamp - kMaxAssociationGap_ns) ++start;
    for (size_t t = start; t < truth.size() && truth[t].stamp_ns <= stamp + kMaxAssociationGap_ns; ++t) {
      candidates.emplace_back(std::abs(truth[t].stamp_ns - stamp), e, t);
    }
  }
  std::sort(candidates.begin(), candidates.end());
  std::vector<bool> estimate_used(estimate.size()), truth_used(truth.size());
  std::vector<PosePair> pairs;
  for (const auto& [gap, e, t] : candidates) {
    if (estimate_used[e] || truth_used[t]) continue;
    estimate_used[e] = truth_used[t] = true;
    pairs.push_back({estimate[e], truth[t]});
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const PosePair& a, const PosePair& b) { return a.estimate.stamp_ns < b.estimate.stamp_ns; });
  return pairs;
}

}  // namespace comap
