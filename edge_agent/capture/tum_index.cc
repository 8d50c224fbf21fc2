#include "edge_agent/capture/tum_index.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <tuple>

#include "edge_agent/capture/image_file.h"
#include "edge_agent/capture/stamp.h"
#include "protocol/types/whole_file.h"

namespace comap {
namespace {

constexpr uintmax_t kMaxText_bytes = uintmax_t{64} << 20;

struct Line {
  size_t number = 0;
  std::vector<std::string> words;
};

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> words;
  size_t i = 0;
  while (i < text.size()) {
    while (i < text.size() && std::isspace(static_cast<unsigned char>(text[i]))) ++i;
    const size_t start = i;
    while (i < text.size() && !std::isspace(static_cast<unsigned char>(text[i]))) ++i;
    if (i > start) words.push_back(text.substr(start, i - start));
  }
  return words;
}

Result<std::vector<Line>> readLines(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::error_code problem;
  const auto size = std::filesystem::file_size(path, problem);
  if (problem) return Error{ErrorCode::kUnreachable, path + ": cannot be read: " + problem.message()};
  if (size > kMaxText_bytes) return Error{ErrorCode::kBadData, path + ": is larger than 64 MiB, expected a short list"};
  std::ifstream file(path);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be opened"};
  std::vector<Line> lines;
  std::string text;
  for (size_t number = 1; std::getline(file, text); ++number) {
    auto words = split(text);
    if (!words.empty() && words[0][0] != '#') lines.push_back({number, std::move(words)});
  }
  return lines;
}

std::string place(const std::string& path, const Line& line) { return path + ":" + std::to_string(line.number); }

struct ListedPicture {
  int64_t stamp_ns = 0;
  std::string path;
};

Result<ListedPicture> readPicture(const std::string& list, const std::string& directory, const Line& line,
                                  size_t first) {
  const auto& stamp = line.words[first];
  const auto& name = line.words[first + 1];
  const auto stamp_ns = parseStamp_ns(stamp);
  if (!stamp_ns) {
    return Error{ErrorCode::kBadData, place(list, line) + ": stamp '" + stamp + "' is not a decimal number of seconds"};
  }
  const std::filesystem::path relative(name);
  const bool leaves = relative.is_absolute() || std::find(relative.begin(), relative.end(), "..") != relative.end();
  if (leaves) {
    return Error{ErrorCode::kBadData, place(list, line) + ": path '" + name + "' leads out of the sequence's folder"};
  }
  return ListedPicture{*stamp_ns, (std::filesystem::path(directory) / relative).string()};
}

Error wrongWordCount(const std::string& list, const Line& line, const char* expected) {
  return {ErrorCode::kBadData, place(list, line) + ": has " + std::to_string(line.words.size()) + " words, expected " +
                                   std::string(expected)};
}

Result<std::vector<TumPair>> readAssociations(const std::string& list, const std::string& directory) {
  auto lines = readLines(list);
  if (!lines) return lines.error();
  std::vector<TumPair> pairs;
  for (const auto& line : *lines) {
    if (line.words.size() != 4) return wrongWordCount(list, line, "4 (stamp colour stamp depth)");
    auto colour = readPicture(list, directory, line, 0);
    if (!colour) return colour.error();
    auto depth = readPicture(list, directory, line, 2);
    if (!depth) return depth.error();
    if (!pairs.empty() && colour->stamp_ns <= pairs.back().stamp_ns) {
      return Error{ErrorCode::kBadData, place(list, line) + ": stamp '" + line.words[0] +
                                            "' is not later than that of the line before (" +
                                            formatStamp(pairs.back().stamp_ns) + ")"};
    }
    pairs.push_back({colour->stamp_ns, std::move(colour->path), std::move(depth->path)});
  }
  return pairs;
}

Result<std::vector<ListedPicture>> readList(const std::string& list, const std::string& directory) {
  auto lines = readLines(list);
  if (!lines) return lines.error();
  std::vector<ListedPicture> pictures;
  for (const auto& line : *lines) {
    if (line.words.size() != 2) return wrongWordCount(list, line, "2 (stamp path)");
    auto picture = readPicture(list, directory, line, 0);
    if (!picture) return picture.error();
    pictures.push_back(std::move(*picture));
  }
  std::stable_sort(pictures.begin(), pictures.end(), [](auto& a, auto& b) { return a.stamp_ns < b.stamp_ns; });
  for (size_t i = 1; i < pictures.size(); ++i) {
    if (pictures[i].stamp_ns == pictures[i - 1].stamp_ns) {
      return Error{ErrorCode::kBadData, list + ": stamp " + formatStamp(pictures[i].stamp_ns) + " occurs twice"};
    }
  }
  return pictures;
}

// The closest pairs first, as the data set's own tool does, so that a picture goes to its nearest partner.
std::vector<TumPair> pairByTime(const std::vector<ListedPicture>& colours, const std::vector<ListedPicture>& depths) {
  std::vector<std::tuple<int64_t, size_t, size_t>> candidates;
  size_t start = 0;
  for (size_t c = 0; c < colours.size(); ++c) {
    while (start < depths.size() && depths[start].stamp_ns < colours[c].stamp_ns - kMaxPairGap_ns) ++start;
    for (size_t d = start; d < depths.size() && depths[d].stamp_ns <= colours[c].stamp_ns + kMaxPairGap_ns; ++d) {
      candidates.emplace_back(std::abs(depths[d].stamp_ns - colours[c].stamp_ns), c, d);
    }
  }
  std::sort(candidates.begin(), candidates.end());
  std::vector<bool> colour_used(colours.size()), depth_used(depths.size());
  std::vector<TumPair> pairs;
  for (const auto& [gap, c, d] : candidates) {
    if (colour_used[c] || depth_used[d]) continue;
    colour_used[c] = depth_used[d] = true;
    pairs.push_back({colours[c].stamp_ns, colours[c].path, depths[d].path});
  }
  std::sort(pairs.begin(), pairs.end(), [](auto& a, auto& b) { return a.stamp_ns < b.stamp_ns; });
  return pairs;
}

}  // namespace

Result<TumCalibration> readTumCalibration(const std::string& path) {
  auto lines = readLines(path);
  if (!lines) return lines.error();
  if (lines->size() != 1 || lines->front().words.size() != 7) {
    const std::string found = lines->size() == 1 ? std::to_string(lines->front().words.size()) + " numbers"
                                                 : std::to_string(lines->size()) + " lines";
    return Error{ErrorCode::kBadData,
                 path + ": has " + found + ", expected one line 'fx fy cx cy width height depth_scale'"};
  }
  const auto& line = lines->front();
  constexpr const char* kNames[] = {"fx", "fy", "cx", "cy", "width", "height", "depth_scale"};
  double values[7];
  for (size_t i = 0; i < 7; ++i) {
    const auto& word = line.words[i];
    const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), values[i]);
    if (problem != std::errc{} || end != word.data() + word.size() || !std::isfinite(values[i])) {
      return Error{ErrorCode::kBadData, place(path, line) + ": " + kNames[i] + " is '" + word + "', not a number"};
    }
  }
  auto wrong = [&](size_t i, const std::string& expected) {
    return Error{ErrorCode::kBadData,
                 place(path, line) + ": " + kNames[i] + " is " + line.words[i] + ", expected " + expected};
  };
  if (values[0] <= 0) return wrong(0, "a positive focal length in pixels");
  if (values[1] == 0) return wrong(1, "a focal length in pixels, negative only if the camera's y points up");
  for (size_t i = 4; i < 6; ++i) {
    if (values[i] != std::floor(values[i]) || values[i] < 1 || values[i] > kMaxImageEdge_px) {
      return wrong(i, "a whole number of pixels from 1 to " + std::to_string(kMaxImageEdge_px));
    }
  }
  for (size_t i = 2; i < 4; ++i) {  // of a picture cut out of a larger one it may lie outside, but not far
    const double edge = values[i + 2];
    if (values[i] < -edge || values[i] > 2 * edge)
      return wrong(i, "the optical axis in or near the picture, from " + std::to_string(-static_cast<int>(edge)) +
                          " to " + std::to_string(2 * static_cast<int>(edge)) + " for one " +
                          std::to_string(static_cast<int>(edge)) + " pixels " + (i == 2 ? "wide" : "high"));
  }
  for (size_t i = 0; i < 2; ++i)
    if (std::abs(values[i]) < 0.1 * values[4] || std::abs(values[i]) > 100 * values[4])
      return wrong(i, "a focal length of 0.1 to 100 times the width in pixels");
  if (values[6] < 1 || values[6] > 1'000'000) return wrong(6, "1 to 1000000 depth values to the metre");
  TumCalibration calibration;
  calibration.camera = {
      values[0], values[1], values[2], values[3], static_cast<int>(values[4]), static_cast<int>(values[5])};
  calibration.depth_scale = values[6];
  return calibration;
}

Result<std::vector<TumPair>> readTumPairs(const std::string& directory) {
  const std::filesystem::path folder(directory);
  const auto associations = (folder / "associations.txt").string();
  std::error_code ignored;
  if (std::filesystem::exists(associations, ignored)) return readAssociations(associations, directory);
  auto colours = readList((folder / "rgb.txt").string(), directory);
  if (!colours) return colours.error();
  auto depths = readList((folder / "depth.txt").string(), directory);
  if (!depths) return depths.error();
  return pairByTime(*colours, *depths);
}

}  // namespace comap
