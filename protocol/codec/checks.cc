#include "protocol/codec/checks.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "protocol/codec/limits.h"

namespace comap::codec {
namespace {

std::string show(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

// Length of the UTF-8 sequence that starts at `at`, or 0 if there is none: no overlong forms, no surrogates.
size_t sequenceLength(const std::string& text, size_t at) {
  const auto byte = [&](size_t i) { return i < text.size() ? static_cast<uint8_t>(text[i]) : uint8_t{0}; };
  const auto follows = [&](size_t i, int low = 0x80, int high = 0xbf) { return byte(i) >= low && byte(i) <= high; };
  const int first = byte(at);
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first <= 0xdf) return follows(at + 1) ? 2 : 0;
  if (first >= 0xe0 && first <= 0xef) {
    const int low = first == 0xe0 ? 0xa0 : 0x80, high = first == 0xed ? 0x9f : 0xbf;
    return follows(at + 1, low, high) && follows(at + 2) ? 3 : 0;
  }
  if (first >= 0xf0 && first <= 0xf4) {
    const int low = first == 0xf0 ? 0x90 : 0x80, high = first == 0xf4 ? 0x8f : 0xbf;
    return follows(at + 1, low, high) && follows(at + 2) && follows(at + 3) ? 4 : 0;
  }
  return 0;
}

bool isCleanText(const std::string& text) {
  for (size_t at = 0; at < text.size();) {
    const size_t length = sequenceLength(text, at);
    if (length == 0) return false;
    const auto first = static_cast<uint8_t>(text[at]);
    if (first < 0x20 || first == 0x7f) return false;
    at += length;
  }
  return true;
}

bool isMapCharacter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '-' ||
         c == '.' || c == '/';
}

}  // namespace

Check& Check::that(bool ok, const std::string& field, const std::string& found_and_expected) {
  if (!ok && problem_.empty()) problem_ = message_ + ": " + field + " " + found_and_expected;
  return *this;
}

Check& Check::robot(const std::string& field, const std::string& value) {
  // The length first, so that a hostile name does not end up in the text.
  if (value.size() > 32)
    return that(false, field, "has " + std::to_string(value.size()) + " characters, expected 1-32");
  const std::string problem = isCleanText(value) ? robotNameProblem(value) : "is not text, expected a robot name";
  return that(problem.empty(), field, problem);
}

Check& Check::id(const std::string& field, const KeyframeId& value) { return robot(field + ".robot", value.robot); }

Check& Check::map(const std::string& field, const MapId& value) {
  const bool good =
      !value.empty() && value.size() <= kMaxMapIdBytes && std::all_of(value.begin(), value.end(), isMapCharacter);
  return that(good, field, "is no map name, expected 1-96 characters of letters, digits, '_', '-', '.' and '/'");
}

Check& Check::text(const std::string& field, const std::string& value) {
  that(value.size() <= kMaxTextBytes, field,
       "has " + std::to_string(value.size()) + " bytes, expected at most " + std::to_string(kMaxTextBytes));
  return that(value.size() > kMaxTextBytes || isCleanText(value), field,
              "is not text, expected UTF-8 without control characters");
}

// What is right is not put into words: that would take longer than to decode it.
Check& Check::count(const std::string& field, size_t value, size_t limit) {
  if (value <= limit) return *this;
  return that(false, field, "has " + std::to_string(value) + " entries, expected at most " + std::to_string(limit));
}

Check& Check::range(const std::string& field, double value, double low, double high) {
  if (value >= low && value <= high) return *this;
  return that(false, field, "is " + show(value) + ", expected " + show(low) + " to " + show(high));
}

Check& Check::finite(const std::string& field, double value) {
  if (std::isfinite(value)) return *this;
  return that(false, field, "is " + show(value) + ", expected a finite number");
}

Check& Check::pose(const std::string& field, const Pose& value) {
  if (!value.isFinite()) return that(false, field, "is not finite");
  if (value.translation().cwiseAbs().maxCoeff() <= kMaxTranslation_m) return *this;
  return that(false, field, "is farther than " + show(kMaxTranslation_m) + " m from its origin");
}

Check& Check::information(const std::string& field, const Matrix6d& value) {
  if (!value.allFinite()) return that(false, field, "is not finite");
  const double scale = std::max(value.cwiseAbs().maxCoeff(), 1e-300);
  that((value - value.transpose()).cwiseAbs().maxCoeff() <= 1e-6 * scale, field, "is not symmetric");
  if (value.diagonal().minCoeff() >= 0) return *this;
  return that(false, field, "has " + show(value.diagonal().minCoeff()) + " on its diagonal, expected none below 0");
}

Check& Check::camera(const std::string& field, const CameraModel& value) {
  range(field + ".width", value.width, kMinImageSide, kMaxImageSide);
  range(field + ".height", value.height, kMinImageSide, kMaxImageSide);
  range(field + ".fx", value.fx, 1, 1e5);
  range(field + ".fy", value.fy, 1, 1e5);
  range(field + ".cx", value.cx, -1e5, 1e5);
  return range(field + ".cy", value.cy, -1e5, 1e5);
}

}  // namespace comap::codec
