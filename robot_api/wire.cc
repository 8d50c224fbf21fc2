#include "robot_api/wire.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

namespace comap::robot_api {
namespace {

static_assert(std::endian::native == std::endian::little, "fields are copied as they lie in memory");

constexpr uint32_t kMagic = 0x50414d43;  // "CMAP"
constexpr size_t kSurfelBytes = 14;

class Writer {
 public:
  explicit Writer(Kind kind) : bytes_(kHeaderBytes, '\0') {
    const auto number = static_cast<uint16_t>(kind);
    std::memcpy(bytes_.data() + 4, &number, sizeof number);
  }
  template <class T>
  Writer& put(const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    const size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
    return *this;
  }
  Writer& text(const std::string& text, size_t most) {
    const auto size = static_cast<uint16_t>(std::min(text.size(), most));
    put(size);
    bytes_.append(text, 0, size);
    return *this;
  }
  void reserve(size_t bytes) { bytes_.reserve(bytes_.size() + bytes); }
  std::string done() {
    const auto size = static_cast<uint32_t>(bytes_.size() - kHeaderBytes);
    std::memcpy(bytes_.data(), &size, sizeof size);
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
};

// Stops at the first field that is not there, and remembers its name.
class Reader {
 public:
  Reader(const char* message, std::span<const uint8_t> body) : message_(message), left_(body) {}
  template <class T>
  Reader& get(const char* field, T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (!problem_.empty()) return *this;
    if (left_.size() < sizeof value) return fail(field, "ends early");
    std::memcpy(&value, left_.data(), sizeof value);
    left_ = left_.subspan(sizeof value);
    return *this;
  }
  Reader& text(const char* field, std::string& text, size_t most) {
    uint16_t size = 0;
    get(field, size);
    if (!problem_.empty()) return *this;
    if (size > most)
      return fail(field, "has " + std::to_string(size) + " bytes; at most " + std::to_string(most) + " are allowed");
    if (left_.size() < size) return fail(field, "ends early");
    text.assign(reinterpret_cast<const char*>(left_.data()), size);
    if (text.find('\0') != std::string::npos) return fail(field, "holds a zero byte");
    left_ = left_.subspan(size);
    return *this;
  }
  template <class T>
  Reader& atMost(const char* field, T value, T most) {
    if (problem_.empty() && value > most)
      fail(field, "is " + std::to_string(value) + "; at most " + std::to_string(most) + " is allowed");
    return *this;
  }
  template <size_t N>
  Reader& finite(const char* field, const std::array<double, N>& values) {
    if (!problem_.empty()) return *this;
    for (const double value : values)
      if (!std::isfinite(value)) return fail(field, "holds " + std::to_string(value) + "; a number is expected");
    return *this;
  }
  Reader& fail(const char* field, const std::string& what) {
    if (problem_.empty()) problem_ = std::string(message_) + ": " + field + " " + what;
    return *this;
  }
  std::span<const uint8_t> left() const { return left_; }
  bool ok() const { return problem_.empty(); }
  Error error() const { return {ErrorCode::kBadData, problem_}; }

 private:
  const char* message_;
  std::span<const uint8_t> left_;
  std::string problem_;
};

template <class T>
Result<T> resultOf(const Reader& reader, T value) {
  if (!reader.ok()) return reader.error();
  return value;
}

}  // namespace

std::string encode(const Greeting& g) {
  return Writer(Kind::kGreeting)
      .put(kMagic)
      .put(g.major)
      .put(g.minor)
      .put(g.session)
      .text(g.robot, kMaxNameBytes)
      .done();
}

std::string encode(const PoseNews& p) {
  return Writer(Kind::kPose)
      .put(p.sequence)
      .put(p.snapshot)
      .put(p.stamp_ns)
      .put(p.known_at_ns)
      .put(p.tracking)
      .put(p.map_state)
      .put(static_cast<uint8_t>(p.has_covariance))
      .put(p.T_map_cam)
      .put(p.T_map_cam_exact)
      .put(p.T_map_odom)
      .put(p.T_map_odom_exact)
      .put(p.T_odom_cam)
      .put(p.covariance)
      .text(p.map, kMaxMapBytes)
      .done();
}

std::string encodeNothing() { return Writer(Kind::kNothing).done(); }

std::string encode(const SurfelsHead& h) {
  return Writer(Kind::kSurfels).put(h.snapshot).put(h.tiles).put(h.surfels).text(h.map, kMaxMapBytes).done();
}

std::string encode(const Tile& tile) {
  Writer writer(Kind::kTile);
  writer.reserve(24 + tile.surfels.size() * kSurfelBytes);
  writer.put(tile.key.x).put(tile.key.y).put(tile.key.z).put(tile.revision);
  writer.put(static_cast<uint32_t>(tile.surfels.size()));
  for (const TileSurfel& s : tile.surfels)
    writer.put(std::array<uint16_t, 3>{s.x, s.y, s.z})
        .put(std::array<uint8_t, 8>{s.normal_u, s.normal_v, s.r, s.g, s.b, s.log_radius, s.confidence, s.contributors});
  return writer.done();
}

std::string encodeUnchanged(uint64_t snapshot) { return Writer(Kind::kUnchanged).put(snapshot).done(); }

std::string encode(const Refusal& r) {
  return Writer(Kind::kRefusal).put(r.code).text(r.sentence, kMaxSentenceBytes).done();
}

std::string encode(const AskPose& a) { return Writer(Kind::kAskPose).put(a.after).put(a.timeout_ms).done(); }

std::string encode(const AskSurfels& a) {
  return Writer(Kind::kAskSurfels).put(a.min_m).put(a.max_m).put(a.known_snapshot).put(a.most_surfels).done();
}

Result<Header> decodeHeader(std::span<const uint8_t, kHeaderBytes> bytes, size_t most_bytes) {
  Header header;
  Reader reader("message", bytes);
  reader.get("length", header.body_bytes).get("kind", header.kind);
  reader.atMost<uint64_t>("length", header.body_bytes, most_bytes);
  return resultOf(reader, header);
}

Result<Greeting> decodeGreeting(std::span<const uint8_t> body) {
  Greeting g;
  uint32_t magic = 0;
  Reader reader("greeting", body);
  reader.get("magic", magic);
  if (reader.ok() && magic != kMagic) reader.fail("magic", "is not that of an edge_agent");
  reader.get("major", g.major).get("minor", g.minor);
  if (reader.ok() && g.major != kMajor)
    reader.fail("major", "is " + std::to_string(g.major) + "; this library speaks " + std::to_string(kMajor));
  reader.get("session", g.session).text("robot", g.robot, kMaxNameBytes);
  return resultOf(reader, g);
}

Result<PoseNews> decodePose(std::span<const uint8_t> body) {
  PoseNews p;
  uint8_t has_covariance = 0;
  Reader reader("pose", body);
  reader.get("sequence", p.sequence)
      .get("snapshot", p.snapshot)
      .get("stamp_ns", p.stamp_ns)
      .get("known_at_ns", p.known_at_ns)
      .get("tracking", p.tracking)
      .get("map_state", p.map_state)
      .get("has_covariance", has_covariance);
  for (const auto& [name, pose] : {std::pair{"T_map_cam", &p.T_map_cam},
                                   {"T_map_cam_exact", &p.T_map_cam_exact},
                                   {"T_map_odom", &p.T_map_odom},
                                   {"T_map_odom_exact", &p.T_map_odom_exact},
                                   {"T_odom_cam", &p.T_odom_cam}})
    reader.get(name, *pose).finite(name, *pose);
  reader.get("covariance", p.covariance).text("map", p.map, kMaxMapBytes);
  p.has_covariance = has_covariance != 0;
  return resultOf(reader, p);
}

Result<SurfelsHead> decodeSurfelsHead(std::span<const uint8_t> body) {
  SurfelsHead h;
  Reader reader("surfels", body);
  reader.get("snapshot", h.snapshot).get("tiles", h.tiles).get("surfels", h.surfels).text("map", h.map, kMaxMapBytes);
  reader.atMost("tiles", h.tiles, kMaxTiles);
  return resultOf(reader, h);
}

Result<Tile> decodeTile(std::span<const uint8_t> body) {
  Tile tile;
  uint32_t count = 0;
  Reader reader("tile", body);
  reader.get("x", tile.key.x).get("y", tile.key.y).get("z", tile.key.z).get("revision", tile.revision);
  reader.get("surfels", count).atMost("surfels", count, kMaxTileSurfels);
  if (reader.ok() && reader.left().size() < count * kSurfelBytes) reader.fail("surfels", "end early");
  if (!reader.ok()) return reader.error();
  tile.surfels.resize(count);
  for (TileSurfel& s : tile.surfels) {
    std::array<uint16_t, 3> p{};
    std::array<uint8_t, 8> r{};
    reader.get("surfels", p).get("surfels", r);
    s = {p[0], p[1], p[2], r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7]};
  }
  return tile;
}

Result<Refusal> decodeRefusal(std::span<const uint8_t> body) {
  Refusal r;
  Reader reader("refusal", body);
  reader.get("code", r.code).text("sentence", r.sentence, kMaxSentenceBytes);
  return resultOf(reader, r);
}

Result<AskPose> decodeAskPose(std::span<const uint8_t> body) {
  AskPose a;
  Reader reader("question for a pose", body);
  reader.get("after", a.after).get("timeout_ms", a.timeout_ms).atMost("timeout_ms", a.timeout_ms, kLongestWait_ms);
  return resultOf(reader, a);
}

Result<AskSurfels> decodeAskSurfels(std::span<const uint8_t> body) {
  AskSurfels a;
  Reader reader("question for surfels", body);
  reader.get("min_m", a.min_m)
      .get("max_m", a.max_m)
      .get("known_snapshot", a.known_snapshot)
      .get("most_surfels", a.most_surfels);
  for (size_t i = 0; i < 3 && reader.ok(); ++i)  // infinite is allowed: everything on that side
    if (!(a.min_m[i] <= a.max_m[i]))
      reader.fail("box",
                  "ends at " + std::to_string(a.max_m[i]) + ", before it begins, at " + std::to_string(a.min_m[i]));
  return resultOf(reader, a);
}

}  // namespace comap::robot_api
