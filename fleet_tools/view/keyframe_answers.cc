#include "fleet_tools/view/keyframe_answers.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "fleet_tools/store/record_json.h"
#include "protocol/codec/codec.h"

namespace comap {
namespace {

constexpr float kNear_m = 0.4f, kFar_m = 6.0f;
constexpr size_t kMostVerdicts = 500;

template <class T>
bool parseNumber(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

ViewAnswer notFound(const std::string& why) { return {404, "text/plain; charset=utf-8", why + "\n"}; }

// By inverse depth, which is how well it is seen.
Rgb depthColour(float depth_m) {
  static constexpr std::array<std::array<float, 3>, 5> kStops = {
      {{18, 16, 40}, {72, 28, 120}, {182, 54, 102}, {246, 142, 68}, {252, 240, 180}}};
  const float near = 1 / kNear_m, far = 1 / kFar_m;
  const float place = std::clamp((1 / depth_m - far) / (near - far), 0.0f, 1.0f);
  const float at = std::sqrt(place) * static_cast<float>(kStops.size() - 1);
  const size_t below = std::min(static_cast<size_t>(at), kStops.size() - 2);
  const float part = at - static_cast<float>(below);
  const auto mix = [&](size_t i) {
    return static_cast<uint8_t>(std::lround((1 - part) * kStops[below][i] + part * kStops[below + 1][i]));
  };
  return {mix(0), mix(1), mix(2)};
}

ColourImage pictureOf(const DepthImage& depth) {
  ColourImage picture(depth.width(), depth.height());
  for (int y = 0; y < depth.height(); ++y)
    for (int x = 0; x < depth.width(); ++x)
      picture.at(x, y) =
          depth.at(x, y) == 0
              ? Rgb{}
              : depthColour(static_cast<float>(depth.at(x, y)) * (1 / static_cast<float>(kDepthUnitsPerMetre)));
  return picture;
}

ViewAnswer picture(const MapStore& store, const KeyframeId& id, bool depth) {
  const auto encoded = store.encodedKeyframe(id);
  if (!encoded) return notFound(encoded.error().text);
  const auto keyframe = decodeKeyframe(*encoded);
  if (!keyframe) return {500, "text/plain; charset=utf-8", keyframe.error().text};
  const auto jpeg = encodeColour(depth ? pictureOf(keyframe->depth) : keyframe->colour, 85);
  if (!jpeg) return {500, "text/plain; charset=utf-8", jpeg.error().text};
  return {200, "image/jpeg", {jpeg->begin(), jpeg->end()}};
}

ViewAnswer verdictsAnswer(const KeyframeId& id, std::vector<MatchVerdict> verdicts) {
  nlohmann::json list = nlohmann::json::array();
  const size_t all = verdicts.size();
  if (all > kMostVerdicts) verdicts.erase(verdicts.begin(), verdicts.end() - static_cast<ptrdiff_t>(kMostVerdicts));
  for (const MatchVerdict& verdict : verdicts) list.push_back(jsonOf(verdict));
  nlohmann::json json = {{"id", toString(id)}, {"verdicts_in_all", all}};
  json["verdicts"] = std::move(list);
  return {200, "application/json", json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

}  // namespace

std::optional<KeyframeId> parseKeyframeId(const std::string& text) {
  const size_t first = text.find('/'), second = text.find('/', first + 1);
  if (first == std::string::npos || second == std::string::npos) return std::nullopt;
  KeyframeId id;
  id.robot = text.substr(0, first);
  if (!robotNameProblem(id.robot).empty() || !parseNumber(text.substr(first + 1, second - first - 1), id.session) ||
      !parseNumber(text.substr(second + 1), id.sequence))
    return std::nullopt;
  return id;
}

ViewAnswer answerAboutKeyframe(const std::string& path, const MapStore* store,
                               const std::function<std::vector<MatchVerdict>(const KeyframeId&)>& verdicts_of) {
  const std::string kKeyframe = "/keyframe/", kPicture = "/picture/";
  if (path.starts_with(kKeyframe)) {
    const auto id = parseKeyframeId(path.substr(kKeyframe.size()));
    return id ? verdictsAnswer(*id, verdicts_of(*id)) : notFound("no keyframe's name");
  }
  const size_t last = path.rfind('/');
  const std::string kind = path.substr(last + 1);
  if (!path.starts_with(kPicture) || last < kPicture.size() || (kind != "colour" && kind != "depth"))
    return notFound("no such page");
  const auto id = parseKeyframeId(path.substr(kPicture.size(), last - kPicture.size()));
  if (!id) return notFound("no keyframe's name");
  if (store == nullptr) return notFound("pictures of keyframes are in the store only");
  return picture(*store, *id, kind == "depth");
}

}  // namespace comap
