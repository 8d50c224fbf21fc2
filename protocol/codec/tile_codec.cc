#include "protocol/codec/tile_codec.h"

#include <array>

#include "comap/v1/tile.pb.h"
#include "protocol/codec/checks.h"
#include "protocol/codec/envelope.h"
#include "protocol/codec/fern_code_codec.h"
#include "protocol/codec/geometry_codec.h"
#include "protocol/codec/limits.h"
#include "protocol/codec/section.h"

namespace comap {
namespace {

constexpr size_t kSurfelBytes = 14;
constexpr int kZstdLevel = 3;

codec::Check check(const Tile& tile) {
  codec::Check check("tile");
  check.map("map", tile.key.map)
      .count("surfels", tile.surfels.size(), kMaxTileSurfels)
      .count("places", tile.places.size(), kMaxTilePlaces);
  for (const TilePlace& place : tile.places) check.pose("places.T_map_cam", place.T_map_cam);
  return check;
}

Result<void> readPlaces(const v1::Tile& message, std::vector<TilePlace>& places) {
  const auto sized = codec::Check("tile").count("places", static_cast<size_t>(message.places_size()), kMaxTilePlaces);
  if (!sized.ok()) return sized.error(ErrorCode::kBadData);
  for (const v1::TilePlace& from : message.places()) {
    const auto T_map_cam = codec::readPose(from.t_map_cam(), "tile: places.T_map_cam");
    if (!T_map_cam) return T_map_cam.error();
    auto code = codec::readFernCode(from.code(), "tile: places.code");
    if (!code) return code.error();
    places.push_back({*T_map_cam, std::move(*code)});
  }
  return {};
}

std::array<uint8_t, kSurfelBytes> toBytes(const TileSurfel& s) {
  const auto low = [](uint16_t value) { return static_cast<uint8_t>(value & 0xff); };
  const auto high = [](uint16_t value) { return static_cast<uint8_t>(value >> 8); };
  return {low(s.x),   high(s.x), low(s.y), high(s.y), low(s.z),     high(s.z),    s.normal_u,
          s.normal_v, s.r,       s.g,      s.b,       s.log_radius, s.confidence, s.contributors};
}

TileSurfel fromBytes(const std::array<uint8_t, kSurfelBytes>& b) {
  const auto join = [](uint8_t low, uint8_t high) { return static_cast<uint16_t>(low | high << 8); };
  return {join(b[0], b[1]), join(b[2], b[3]), join(b[4], b[5]), b[6], b[7], b[8], b[9], b[10], b[11], b[12], b[13]};
}

// Column by column: like next to like is what zstd can shorten.
std::vector<uint8_t> toColumns(const std::vector<TileSurfel>& surfels) {
  std::vector<uint8_t> columns(surfels.size() * kSurfelBytes);
  for (size_t i = 0; i < surfels.size(); ++i) {
    const auto bytes = toBytes(surfels[i]);
    for (size_t column = 0; column < kSurfelBytes; ++column) columns[column * surfels.size() + i] = bytes[column];
  }
  return columns;
}

std::vector<TileSurfel> fromColumns(const std::vector<uint8_t>& columns, size_t count) {
  std::vector<TileSurfel> surfels(count);
  for (size_t i = 0; i < count; ++i) {
    std::array<uint8_t, kSurfelBytes> bytes;
    for (size_t column = 0; column < kSurfelBytes; ++column) bytes[column] = columns[column * count + i];
    surfels[i] = fromBytes(bytes);
  }
  return surfels;
}

}  // namespace

Result<std::vector<uint8_t>> encodeTile(const Tile& tile) {
  if (const auto checked = check(tile); !checked.ok()) return checked.error(ErrorCode::kWrongUse);
  v1::Tile message;
  message.set_map(tile.key.map);
  message.set_x(tile.key.x);
  message.set_y(tile.key.y);
  message.set_z(tile.key.z);
  message.set_revision(tile.revision);
  message.set_surfel_count(static_cast<uint32_t>(tile.surfels.size()));
  if (!tile.surfels.empty()) {
    const std::vector<uint8_t> packed = codec::compress(toColumns(tile.surfels), kZstdLevel);
    message.set_surfels(packed.data(), packed.size());
  }
  for (const TilePlace& place : tile.places) {
    v1::TilePlace* to = message.add_places();
    codec::write(place.T_map_cam, to->mutable_t_map_cam());
    if (const auto written = codec::write(place.code, to->mutable_code(), "tile: places.code"); !written)
      return written.error();
  }
  return codec::serialise(message, "tile", kMaxLargeMessageBytes);
}

Result<Tile> decodeTile(std::span<const uint8_t> bytes) {
  const auto message = codec::parse<v1::Tile>(bytes, "tile", kMaxLargeMessageBytes);
  if (!message) return message.error();
  Tile tile{{message->map(), message->x(), message->y(), message->z()}, message->revision()};
  if (const auto read = readPlaces(*message, tile.places); !read) return read.error();
  const size_t count = message->surfel_count();
  const auto sized = check(tile).count("surfel_count", count, kMaxTileSurfels);
  if (!sized.ok()) return sized.error(ErrorCode::kBadData);
  if (count == 0) {
    if (!message->surfels().empty()) return Error{ErrorCode::kBadData, "tile: surfels without a surfel_count"};
    return tile;
  }
  const auto& packed = message->surfels();
  const auto columns = codec::decompress({reinterpret_cast<const uint8_t*>(packed.data()), packed.size()},
                                         count * kSurfelBytes, "tile: surfels");
  if (!columns) return columns.error();
  tile.surfels = fromColumns(*columns, count);
  return tile;
}

}  // namespace comap
