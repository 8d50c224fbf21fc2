#include "edge_agent/capture/source_uri.h"

#include <charconv>
#include <filesystem>
#include <optional>

#include "edge_agent/capture/icl_source.h"
#include "edge_agent/capture/klg_source.h"

namespace comap {
namespace {

// "12" -> 12, "" -> fallback, anything else -> nullopt.
std::optional<size_t> parseIndex(const std::string& text, size_t fallback) {
  if (text.empty()) return fallback;
  size_t value = 0;
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (problem != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

// The part before the first colon if it looks like a scheme: letters, digits, + and - only, two at least.
std::string schemeOf(const std::string& uri) {
  const size_t colon = uri.find(':');
  if (colon == std::string::npos || colon < 2) return "";
  const std::string scheme = uri.substr(0, colon);
  const bool plain = scheme.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789+-") == std::string::npos;
  return plain ? scheme : "";
}

}  // namespace

Result<TumPlace> parseTumPlace(const std::string& text) {
  TumPlace place{text, {}};
  const size_t at = text.rfind('@');
  std::error_code ignored;
  const bool none = at == std::string::npos || text.find('/', at) != std::string::npos;
  if (!none && !std::filesystem::exists(text, ignored)) {
    const std::string asked = text.substr(at + 1);
    const size_t colon = asked.find(':');
    std::optional<size_t> first, last;
    if (colon != std::string::npos) {
      first = parseIndex(asked.substr(0, colon), 0);
      last = parseIndex(asked.substr(colon + 1), TumRange::kToEnd);
    }
    if (!first || !last) {
      return Error{ErrorCode::kWrongUse, text + ": range '" + asked + "' is not FIRST:LAST (frame indices from 0)"};
    }
    place.directory = text.substr(0, at);
    place.range = {*first, *last};
  }
  if (place.directory.empty()) return Error{ErrorCode::kWrongUse, "source '" + text + "': names no folder"};
  return place;
}

Result<std::unique_ptr<FrameSource>> openSource(const std::string& uri, const CameraConfig& camera, CaptureLog log) {
  const std::string scheme = schemeOf(uri);
  if (isCameraScheme(scheme)) return openCamera(scheme, uri.substr(scheme.size() + 1), camera, std::move(log));
  if (scheme == "libcamera")
    return Error{ErrorCode::kWrongUse, "source '" + uri +
                                           "': libcamera gives colour alone; name a depth stream beside it, "
                                           "as in pair:" +
                                           uri + ",openni2:"};
  if (!scheme.empty() && scheme != "tum" && scheme != "icl" && scheme != "klg") {
    std::string known;
    for (const auto& line : knownSources()) known += (known.empty() ? "" : "; ") + line;
    return Error{ErrorCode::kWrongUse, "source '" + uri + "': scheme '" + scheme + "' is unknown, known are: " + known};
  }
  auto place = parseTumPlace(scheme.empty() ? uri : uri.substr(scheme.size() + 1));
  if (!place) return place.error();
  if (scheme == "icl") return openIcl(place->directory, place->range);
  if (scheme == "klg") return openKlg(place->directory, place->range, camera);
  return openTum(place->directory, place->range);
}

std::vector<std::string> knownSources() {
  std::vector<std::string> lines{
      "tum:DIR[@FIRST:LAST] (a recorded sequence in the TUM RGB-D format; also plain DIR[@FIRST:LAST])",
      "icl:DIR[@FIRST:LAST] (an ICL-NUIM sequence in its TUM-compatible form, as it is distributed)",
      "klg:FILE[@FIRST:LAST] (a log of Logger2 or ElasticFusion; focal lengths from the configuration)"};
  for (std::string& line : cameraSchemes()) lines.push_back(std::move(line));
  return lines;
}

}  // namespace comap
