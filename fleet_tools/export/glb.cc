#include "fleet_tools/export/glb.h"

#include <array>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

namespace comap {
namespace {

using Json = nlohmann::json;

constexpr uint32_t kMagic = 0x46546c67, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;
constexpr int kFloat = 5126, kByte = 5121, kArrayBuffer = 34962, kPoints = 0;

// One attribute: its column of the binary chunk.
struct Column {
  const char* name;
  const char* type;
  int component;
  size_t bytes_each;
};
constexpr std::array<Column, 5> kColumns = {{{"POSITION", "VEC3", kFloat, 12},
                                             {"NORMAL", "VEC3", kFloat, 12},
                                             {"COLOR_0", "VEC4", kByte, 4},
                                             {"_RADIUS", "SCALAR", kFloat, 4},
                                             {"_CONFIDENCE", "SCALAR", kFloat, 4}}};
constexpr size_t kBytesEach = 36;

// glTF wants unit normals; a point without one gets any.
Eigen::Vector3f unit(const Eigen::Vector3f& normal) {
  const float norm = normal.norm();
  return norm > 0.1f ? Eigen::Vector3f(normal / norm) : Eigen::Vector3f::UnitZ();
}

std::string columnsOf(std::span<const MapPoint> points) {
  std::string bytes(kBytesEach * points.size(), '\0');
  char* at = bytes.data();
  const auto put = [&](const void* value, size_t size) {
    std::memcpy(at, value, size);
    at += size;
  };
  for (const MapPoint& point : points) put(point.position.data(), 12);
  for (const MapPoint& point : points) put(unit(point.normal).eval().data(), 12);
  for (const MapPoint& point : points) {
    const std::array<uint8_t, 4> colour = {point.colour.r, point.colour.g, point.colour.b, 255};
    put(colour.data(), 4);
  }
  for (const MapPoint& point : points) put(&point.radius, 4);
  for (const MapPoint& point : points) put(&point.confidence, 4);
  return bytes;
}

Json describe(std::span<const MapPoint> points, const GlbOptions& options) {
  Json accessors = Json::array(), views = Json::array(), attributes = Json::object();
  size_t offset = 0;
  for (const Column& column : kColumns) {
    attributes[column.name] = accessors.size();
    Json accessor = {{"bufferView", views.size()},
                     {"componentType", column.component},
                     {"count", points.size()},
                     {"type", column.type}};
    if (column.component == kByte) accessor["normalized"] = true;
    accessors.push_back(std::move(accessor));
    views.push_back({{"buffer", 0},
                     {"byteOffset", offset},
                     {"byteLength", column.bytes_each * points.size()},
                     {"target", kArrayBuffer}});
    offset += column.bytes_each * points.size();
  }
  Eigen::Vector3f low = points[0].position, high = low;
  for (const MapPoint& point : points) {
    low = low.cwiseMin(point.position);
    high = high.cwiseMax(point.position);
  }
  accessors[0]["min"] = {low.x(), low.y(), low.z()};
  accessors[0]["max"] = {high.x(), high.y(), high.z()};
  const Eigen::Quaterniond& q = options.rotation;
  // Light would need a reflectance that nobody has measured: the colours are as the cameras saw them.
  const auto one = [](Json json) { return Json::array({std::move(json)}); };
  Json primitive = {{"attributes", attributes}, {"mode", kPoints}, {"material", 0}};
  Json material = {{"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}},
                   {"extensions", {{"KHR_materials_unlit", Json::object()}}}};
  return {{"asset", {{"version", "2.0"}, {"generator", "CoMap " COMAP_VERSION}}},
          {"extensionsUsed", one("KHR_materials_unlit")},
          {"scene", 0},
          {"scenes", one({{"nodes", one(0)}})},
          {"nodes", one({{"mesh", 0}, {"name", options.name}, {"rotation", {q.x(), q.y(), q.z(), q.w()}}})},
          {"meshes", one({{"primitives", one(std::move(primitive))}})},
          {"materials", one(std::move(material))},
          {"accessors", accessors},
          {"bufferViews", views},
          {"buffers", one({{"byteLength", kBytesEach * points.size()}})}};
}

void putNumber(std::string& out, uint32_t value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); }

}  // namespace

Result<void> writeGlb(const std::string& path, std::span<const MapPoint> points, const GlbOptions& options) {
  if (points.empty()) return Error{ErrorCode::kProblem, path + ": there are no points to write"};
  constexpr size_t kMost = (std::numeric_limits<uint32_t>::max() - (1u << 20)) / kBytesEach;
  if (points.size() > kMost)
    return Error{ErrorCode::kProblem, path + ": " + std::to_string(points.size()) + " points, a GLB holds at most " +
                                          std::to_string(kMost) + "; --format tiles3d has no such limit"};
  std::string json = describe(points, options).dump(-1, ' ', false, Json::error_handler_t::replace);
  json.append((4 - json.size() % 4) % 4, ' ');
  const std::string binary = columnsOf(points);  // a multiple of 4 already
  std::string head;
  putNumber(head, kMagic);
  putNumber(head, 2);
  putNumber(head, static_cast<uint32_t>(12 + 8 + json.size() + 8 + binary.size()));
  putNumber(head, static_cast<uint32_t>(json.size()));
  putNumber(head, kJsonChunk);
  std::string middle;
  putNumber(middle, static_cast<uint32_t>(binary.size()));
  putNumber(middle, kBinaryChunk);
  std::ofstream out(path, std::ios::binary);
  out << head << json << middle << binary;
  out.flush();
  if (!out) return Error{ErrorCode::kUnreachable, path + ": cannot be written"};
  return {};
}

}  // namespace comap
