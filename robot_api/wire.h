// What an agent and the programs on its robot say to each other over a local socket, see docs/robot-api.md: frames of a
// header of 8 bytes (length of the body, kind) and a body of fixed fields, all little-endian. A body may be longer than
// what is known of it: what a newer peer adds at the end is passed over.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocol/types/result.h"
#include "protocol/types/tile.h"

namespace comap::robot_api {

inline constexpr uint16_t kMajor = 1, kMinor = 0;  ///< peers of another major do not understand each other
inline constexpr size_t kHeaderBytes = 8;
inline constexpr size_t kMaxRequestBytes = 256;  ///< of a body
inline constexpr size_t kMaxAnswerBytes = size_t{16} << 20;
inline constexpr uint32_t kMaxTileSurfels = 1u << 20;
inline constexpr uint32_t kMaxTiles = 1u << 20;
inline constexpr size_t kMaxMapBytes = 127, kMaxNameBytes = 64, kMaxSentenceBytes = 1024;
inline constexpr uint32_t kLongestWait_ms = 60'000;

enum class Kind : uint16_t {
  kGreeting = 1,  ///< agent, first
  kPose = 2,
  kNothing = 3,  ///< no (newer) pose in time
  kSurfels = 4,  ///< then as many kTile as it says
  kTile = 5,
  kUnchanged = 6,  ///< tiles are those of the snapshot that is known
  kRefusal = 7,
  kAskPose = 16,  ///< program; one question at a time
  kAskSurfels = 17,
};

struct Header {
  uint32_t body_bytes = 0;
  uint16_t kind = 0;
};

struct Greeting {
  uint16_t major = kMajor, minor = kMinor;
  uint64_t session = 0;
  std::string robot;
};

using PlainPose = std::array<double, 7>;  ///< x y z, qx qy qz qw; bits are kept

struct PoseNews {
  uint64_t sequence = 0, snapshot = 0;
  int64_t stamp_ns = 0, known_at_ns = 0;
  uint8_t tracking = 0, map_state = 0;
  bool has_covariance = false;
  std::string map;
  PlainPose T_map_cam{}, T_map_cam_exact{}, T_map_odom{}, T_map_odom_exact{}, T_odom_cam{};
  std::array<double, 36> covariance{};
};

struct SurfelsHead {
  uint64_t snapshot = 0;
  uint32_t tiles = 0;
  uint64_t surfels = 0;
  std::string map;
};

/// Those of comap_robot.h's codes that an agent answers with.
inline constexpr int32_t kUnreachable = -2, kBadData = -3, kTooLarge = -4;

/// Why there is no answer.
struct Refusal {
  int32_t code = 0;  ///< negative
  std::string sentence;
};

struct AskPose {
  uint64_t after = 0;       ///< a sequence; any pose above it
  uint32_t timeout_ms = 0;  ///< 0: only what is there already
};

struct AskSurfels {
  std::array<double, 3> min_m{}, max_m{};
  uint64_t known_snapshot = 0;
  uint64_t most_surfels = 0;
};

/// A whole frame. Texts longer than allowed are cut.
std::string encode(const Greeting& greeting);
std::string encode(const PoseNews& pose);
std::string encodeNothing();
std::string encode(const SurfelsHead& head);
std::string encode(const Tile& tile);  ///< without its map and places
std::string encodeUnchanged(uint64_t snapshot);
std::string encode(const Refusal& refusal);
std::string encode(const AskPose& ask);
std::string encode(const AskSurfels& ask);

/// kBadData if a body of that length must not be. `most_bytes`: kMaxRequestBytes or kMaxAnswerBytes.
Result<Header> decodeHeader(std::span<const uint8_t, kHeaderBytes> bytes, size_t most_bytes);

/// Of a body. kBadData names the field that is missing or out of range.
Result<Greeting> decodeGreeting(std::span<const uint8_t> body);
Result<PoseNews> decodePose(std::span<const uint8_t> body);
Result<SurfelsHead> decodeSurfelsHead(std::span<const uint8_t> body);
Result<Tile> decodeTile(std::span<const uint8_t> body);
Result<Refusal> decodeRefusal(std::span<const uint8_t> body);
Result<AskPose> decodeAskPose(std::span<const uint8_t> body);
Result<AskSurfels> decodeAskSurfels(std::span<const uint8_t> body);

}  // namespace comap::robot_api
