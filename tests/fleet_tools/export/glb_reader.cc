#include "tests/fleet_tools/export/glb_reader.h"

#include <cstring>
#include <fstream>
#include <iterator>

namespace comap {
namespace {

using Json = nlohmann::json;

uint32_t number(const std::string& bytes, size_t at) {
  uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// A column of `T`, all within its view and the buffer.
template <class T>
std::vector<T> column(const GlbPoints& glb, const std::string& binary, const char* attribute, const char* type,
                      int component, std::string& problem) {
  const Json& primitive = glb.json.at("meshes")[0].at("primitives")[0];
  const Json& accessor = glb.json.at("accessors")[primitive.at("attributes").at(attribute).get<size_t>()];
  const Json& view = glb.json.at("bufferViews")[accessor.at("bufferView").get<size_t>()];
  const size_t count = accessor.at("count").get<size_t>(), offset = view.at("byteOffset").get<size_t>();
  if (accessor.at("type") != type || accessor.at("componentType") != component) problem = "type of the accessor";
  if (view.at("byteLength").get<size_t>() != count * sizeof(T) || offset % 4 != 0) problem = "length of the view";
  if (offset + count * sizeof(T) > binary.size()) problem = "view beyond the buffer";
  std::vector<T> values(count);
  if (problem.empty() && count > 0)
    std::memcpy(static_cast<void*>(values.data()), binary.data() + offset, count * sizeof(T));
  return values;
}

}  // namespace

GlbPoints readGlb(const std::string& path) {
  GlbPoints glb;
  std::ifstream file(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(file), {}};
  const auto refuse = [&](const std::string& why) {
    glb.problem = why;
    return glb;
  };
  if (bytes.size() < 28 || bytes.substr(0, 4) != "glTF" || number(bytes, 4) != 2) return refuse("header");
  if (number(bytes, 8) != bytes.size()) return refuse("length");
  const size_t json_bytes = number(bytes, 12);
  if (number(bytes, 16) != 0x4E4F534A || json_bytes % 4 != 0 || 28 + json_bytes > bytes.size())
    return refuse("JSON chunk");
  const size_t binary_bytes = number(bytes, 20 + json_bytes);
  if (number(bytes, 24 + json_bytes) != 0x004E4942 || binary_bytes % 4 != 0 ||
      28 + json_bytes + binary_bytes != bytes.size())
    return refuse("binary chunk");
  glb.json = Json::parse(bytes.substr(20, json_bytes), nullptr, false);
  if (glb.json.is_discarded()) return refuse("JSON");
  const std::string binary = bytes.substr(28 + json_bytes);
  if (glb.json.at("asset").at("version") != "2.0") return refuse("version");
  if (glb.json.at("buffers").size() != 1 || glb.json.at("buffers")[0].at("byteLength") != binary.size() ||
      glb.json.at("buffers")[0].contains("uri"))
    return refuse("buffer");
  if (glb.json.at("meshes")[0].at("primitives")[0].at("mode") != 0) return refuse("mode");
  const Json& node = glb.json.at("nodes")[glb.json.at("scenes")[0].at("nodes")[0].get<size_t>()];
  if (node.at("mesh") != 0) return refuse("node");
  const auto q = node.at("rotation").get<std::array<double, 4>>();
  glb.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
  if (std::abs(glb.rotation.norm() - 1) > 1e-6) return refuse("rotation");
  glb.positions = column<Eigen::Vector3f>(glb, binary, "POSITION", "VEC3", 5126, glb.problem);
  glb.normals = column<Eigen::Vector3f>(glb, binary, "NORMAL", "VEC3", 5126, glb.problem);
  glb.colours = column<std::array<uint8_t, 4>>(glb, binary, "COLOR_0", "VEC4", 5121, glb.problem);
  glb.radii = column<float>(glb, binary, "_RADIUS", "SCALAR", 5126, glb.problem);
  glb.confidences = column<float>(glb, binary, "_CONFIDENCE", "SCALAR", 5126, glb.problem);
  const size_t count = glb.positions.size();
  if (glb.normals.size() != count || glb.colours.size() != count || glb.radii.size() != count) return refuse("counts");
  const Json& bounds = glb.json.at("accessors")[0];
  Eigen::Vector3f low = glb.positions.at(0), high = low;
  for (const auto& position : glb.positions) {
    low = low.cwiseMin(position);
    high = high.cwiseMax(position);
  }
  for (int axis = 0; axis < 3; ++axis)
    if (bounds.at("min")[size_t(axis)].get<float>() != low[axis] ||
        bounds.at("max")[size_t(axis)].get<float>() != high[axis])
      return refuse("min and max");
  for (const auto& normal : glb.normals)
    if (std::abs(normal.norm() - 1) > 1e-5f) return refuse("a normal is not unit");
  return glb;
}

}  // namespace comap
