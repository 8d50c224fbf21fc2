#include "edge_agent/capture/icl_source.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <set>

namespace comap {
namespace {

namespace fs = std::filesystem;

constexpr TumCalibration kCalibration{{481.2, -480.0, 319.5, 239.5, 640, 480}, 5000};

// The numbers N for which FOLDER/N.png exists.
std::set<int64_t> numbersIn(const fs::path& folder) {
  std::set<int64_t> numbers;
  std::error_code problem;
  for (fs::directory_iterator entry(folder, problem), end; !problem && entry != end; entry.increment(problem)) {
    if (entry->path().extension() != ".png") continue;
    const std::string stem = entry->path().stem().string();
    int64_t number = 0;
    const auto [rest, wrong] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
    if (wrong == std::errc{} && rest == stem.data() + stem.size() && number >= 0 && number < 1'000'000'000 &&
        stem == std::to_string(number))
      numbers.insert(number);
  }
  return numbers;
}

std::vector<TumPair> numberedPairs(const std::string& directory) {
  const fs::path root(directory);
  const std::set<int64_t> depths = numbersIn(root / "depth");
  std::vector<TumPair> pairs;
  for (const int64_t number : numbersIn(root / "rgb")) {
    if (!depths.contains(number)) continue;
    const std::string name = std::to_string(number) + ".png";
    pairs.push_back({number * 1'000'000'000, (root / "rgb" / name).string(), (root / "depth" / name).string()});
  }
  return pairs;
}

}  // namespace

Result<std::unique_ptr<FrameSource>> openIcl(const std::string& directory, TumRange range) {
  std::error_code problem;
  const fs::path root(directory);
  if (!fs::is_directory(root, problem))
    return Error{ErrorCode::kUnreachable, directory + ": is not a folder that can be read"};
  TumCalibration calibration = kCalibration;
  if (fs::exists(root / "calibration.txt", problem)) {
    auto given = readTumCalibration((root / "calibration.txt").string());
    if (!given) return given.error();
    calibration = *given;
  }
  std::vector<TumPair> pairs;
  if (fs::exists(root / "associations.txt", problem)) {
    auto listed = readTumPairs(directory);
    if (!listed) return listed.error();
    pairs = std::move(*listed);
    for (TumPair& pair : pairs)
      if (fs::path(pair.colour_path).parent_path().filename() == "depth") std::swap(pair.colour_path, pair.depth_path);
  } else {
    pairs = numberedPairs(directory);
  }
  if (pairs.empty())
    return Error{ErrorCode::kBadData, directory + ": has neither associations.txt nor rgb/N.png with depth/N.png"};
  return openTumPairs("ICL-NUIM", directory, range, calibration, std::move(pairs));
}

}  // namespace comap
