#include "fleet_tools/export/ply.h"

#include <bit>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "protocol/types/whole_file.h"

namespace comap {
namespace {

static_assert(std::endian::native == std::endian::little, "PLY is written as the machine holds it");

using Eigen::Vector3f;

constexpr uintmax_t kMaxFile_bytes = uintmax_t{8} << 30;
constexpr size_t kMaxHeaderLines = 1000;

enum class Kind { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct KindName {
  const char* name;
  Kind kind;
  size_t bytes;
};
constexpr KindName kKinds[] = {{"char", Kind::kInt8, 1},     {"int8", Kind::kInt8, 1},     {"uchar", Kind::kUint8, 1},
                               {"uint8", Kind::kUint8, 1},   {"short", Kind::kInt16, 2},   {"int16", Kind::kInt16, 2},
                               {"ushort", Kind::kUint16, 2}, {"uint16", Kind::kUint16, 2}, {"int", Kind::kInt32, 4},
                               {"int32", Kind::kInt32, 4},   {"uint", Kind::kUint32, 4},   {"uint32", Kind::kUint32, 4},
                               {"float", Kind::kFloat, 4},   {"float32", Kind::kFloat, 4}, {"double", Kind::kDouble, 8},
                               {"float64", Kind::kDouble, 8}};

// Where a vertex property goes: 0-2 position, 3-5 normal, 6 radius, -1 nowhere.
struct Property {
  Kind kind;
  size_t bytes;
  int target;
};

struct Header {
  bool ascii = false;
  uint64_t vertices = 0;
  size_t stride = 0;
  bool normals = false, radii = false;
  std::vector<Property> properties;
};

int targetOf(const std::string& name) {
  constexpr const char* kNames[] = {"x", "y", "z", "nx", "ny", "nz", "radius"};
  for (int i = 0; i < 7; ++i) {
    if (name == kNames[i]) return i;
  }
  return -1;
}

Error bad(const std::string& path, const std::string& text) { return {ErrorCode::kBadData, path + ": " + text}; }

Result<void> readProperty(const std::string& path, std::istringstream& words, Header& header) {
  std::string type, name;
  words >> type >> name;
  if (type == "list") return bad(path, "vertex property of kind 'list' is not read");
  const KindName* kind = nullptr;
  for (const auto& known : kKinds) {
    if (type == known.name) kind = &known;
  }
  if (kind == nullptr || name.empty()) return bad(path, "vertex property '" + type + " " + name + "' is not known");
  const bool real = kind->kind == Kind::kFloat || kind->kind == Kind::kDouble;
  const int target = name == "radius" && !real ? -1 : targetOf(name);
  if (target >= 0 && target < 3 && !real)
    return bad(path, "property " + name + " is " + type + ", expected float or double");
  if (target >= 3 && !real && kind->kind != Kind::kInt8) {
    return bad(path, "property " + name + " is " + type + ", expected float, double or int8");
  }
  for (const auto& other : header.properties) {
    if (target >= 0 && other.target == target) return bad(path, "property " + name + " occurs twice");
  }
  if (header.properties.size() >= 256) return bad(path, "more than 256 vertex properties");
  header.properties.push_back({kind->kind, kind->bytes, target});
  header.stride += kind->bytes;
  return {};
}

Result<Header> readHeader(const std::string& path, std::istream& file) {
  Header header;
  std::string line;
  bool format_seen = false, in_vertex = false, vertex_seen = false;
  for (size_t number = 0; number < kMaxHeaderLines; ++number) {
    line.clear();
    for (int c = file.get(); c != '\n'; c = file.get()) {
      if (c == std::char_traits<char>::eof() || line.size() > 4096) return bad(path, "the header ends too early");
      if (c != '\r') line.push_back(static_cast<char>(c));
    }
    std::istringstream words(line);
    std::string word, value;
    words >> word;
    if (number == 0) {
      if (line != "ply") return bad(path, "does not begin with 'ply'");
    } else if (word == "format") {
      words >> value;
      if (value != "ascii" && value != "binary_little_endian") {
        return bad(path, "format '" + value + "' is not read, expected ascii or binary_little_endian");
      }
      header.ascii = value == "ascii";
      format_seen = true;
    } else if (word == "element") {
      std::string count;
      words >> value >> count;
      if (!vertex_seen && value != "vertex") return bad(path, "first element is '" + value + "', expected vertex");
      in_vertex = !vertex_seen;
      if (!in_vertex) continue;
      vertex_seen = true;
      const auto [end, problem] = std::from_chars(count.data(), count.data() + count.size(), header.vertices);
      if (problem != std::errc{} || end != count.data() + count.size()) {
        return bad(path, "number of vertices is '" + count + "'");
      }
    } else if (word == "property" && in_vertex) {
      if (auto property = readProperty(path, words, header); !property) return property.error();
    } else if (word == "end_header") {
      if (!format_seen || !vertex_seen) return bad(path, "the header names no format or no vertices");
      unsigned found = 0;
      for (const auto& property : header.properties) {
        if (property.target >= 0) found |= 1u << property.target;
      }
      if ((found & 7u) != 7u) return bad(path, "vertices have no x, y and z");
      if ((found & 56u) != 0 && (found & 56u) != 56u) return bad(path, "normals are not complete (nx ny nz)");
      header.normals = (found & 56u) == 56u;
      header.radii = (found & 64u) != 0;
      return header;
    }
  }
  return bad(path, "the header has more than " + std::to_string(kMaxHeaderLines) + " lines");
}

template <class T>
float load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof value);
  return static_cast<float>(value);
}

float valueOf(const Property& property, const char* bytes) {
  switch (property.kind) {
    case Kind::kFloat:
      return load<float>(bytes);
    case Kind::kDouble:
      return load<double>(bytes);
    default:
      return load<int8_t>(bytes) / 127.0f;
  }
}

Result<void> keep(const std::string& path, const Header& header, const float* values, PlyPoints& points) {
  const size_t number = points.positions.size();
  for (int i = 0; i < (header.normals ? 6 : 3); ++i) {
    if (!std::isfinite(values[i])) return bad(path, "vertex " + std::to_string(number) + " is not finite");
  }
  points.positions.emplace_back(values[0], values[1], values[2]);
  if (header.normals) {
    const Vector3f normal(values[3], values[4], values[5]);
    const float length = normal.norm();
    points.normals.push_back(length > 1e-6f ? Vector3f(normal / length) : Vector3f::Zero());
  }
  if (header.radii) {
    if (!std::isfinite(values[6])) return bad(path, "radius of vertex " + std::to_string(number) + " is not finite");
    points.radii.push_back(values[6]);
  }
  return {};
}

Result<void> readBinary(const std::string& path, std::istream& file, const Header& header, PlyPoints& points) {
  std::vector<char> row(header.stride);
  float values[7] = {};
  for (uint64_t i = 0; i < header.vertices; ++i) {
    if (!file.read(row.data(), static_cast<std::streamsize>(row.size()))) {
      return bad(path, "ends after " + std::to_string(i) + " of " + std::to_string(header.vertices) + " vertices");
    }
    const char* bytes = row.data();
    for (const auto& property : header.properties) {
      if (property.target >= 0) values[property.target] = valueOf(property, bytes);
      bytes += property.bytes;
    }
    if (auto kept = keep(path, header, values, points); !kept) return kept;
  }
  return {};
}

Result<void> readAscii(const std::string& path, std::istream& file, const Header& header, PlyPoints& points) {
  float values[7] = {};
  std::string word;
  for (uint64_t i = 0; i < header.vertices; ++i) {
    for (const auto& property : header.properties) {
      if (!(file >> word)) {
        return bad(path, "ends after " + std::to_string(i) + " of " + std::to_string(header.vertices) + " vertices");
      }
      double value = 0;
      const auto [end, problem] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (problem != std::errc{} || end != word.data() + word.size()) {
        return bad(path, "vertex " + std::to_string(i) + " has '" + word.substr(0, 40) + "' for a number");
      }
      if (property.target >= 0) {
        values[property.target] = static_cast<float>(property.kind == Kind::kInt8 ? value / 127 : value);
      }
    }
    if (auto kept = keep(path, header, values, points); !kept) return kept;
  }
  return {};
}

template <class... Values>
char* put(char* target, Values... values) {
  ((std::memcpy(target, &values, sizeof values), target += sizeof values), ...);
  return target;
}

Result<void> finish(const std::string& path, std::ofstream& file) {
  file.close();
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be written: " + std::strerror(errno)};
  return {};
}

}  // namespace

Result<void> writePly(const std::string& path, std::span<const MapPoint> points) {
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\nelement vertex " << points.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n"
          "property float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float radius\n"
          "property float confidence\nend_header\n";
  for (const auto& p : points) {
    char row[35];
    put(row, p.position.x(), p.position.y(), p.position.z(), p.normal.x(), p.normal.y(), p.normal.z(), p.colour.r,
        p.colour.g, p.colour.b, p.radius, p.confidence);
    file.write(row, sizeof row);
  }
  return finish(path, file);
}

Result<void> writePlySurface(const std::string& path, const PlyPoints& points, const std::string& comment) {
  if (points.normals.size() != points.positions.size()) {
    return Error{ErrorCode::kWrongUse, path + ": a surface needs a normal for each point"};
  }
  std::ofstream file(path, std::ios::binary);
  file << "ply\nformat binary_little_endian 1.0\ncomment " << comment << "\nelement vertex " << points.positions.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny\n"
          "property float nz\nend_header\n";
  for (size_t i = 0; i < points.positions.size(); ++i) {
    const Vector3f &p = points.positions[i], &n = points.normals[i];
    char row[24];
    put(row, p.x(), p.y(), p.z(), n.x(), n.y(), n.z());
    file.write(row, sizeof row);
  }
  return finish(path, file);
}

Result<PlyPoints> readPly(const std::string& path) {
  if (auto regular = checkRegular(path); !regular) return regular.error();
  std::error_code problem;
  const auto size = std::filesystem::file_size(path, problem);
  if (problem) return Error{ErrorCode::kUnreachable, path + ": cannot be read: " + problem.message()};
  if (size > kMaxFile_bytes) return bad(path, "is larger than 8 GiB");
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{ErrorCode::kUnreachable, path + ": cannot be opened"};
  auto header = readHeader(path, file);
  if (!header) return header.error();
  // Before memory is taken: a vertex needs its bytes, and in ASCII a digit and a space for each property.
  const uint64_t least = header->ascii ? 2 * header->properties.size() : header->stride;
  const uint64_t left = size - static_cast<uint64_t>(file.tellg());
  if (header->vertices > left / least + 1) {
    return bad(path, "says " + std::to_string(header->vertices) + " vertices, more than the " + std::to_string(left) +
                         " bytes behind its header hold");
  }
  PlyPoints points;
  points.positions.reserve(header->vertices);
  if (header->normals) points.normals.reserve(header->vertices);
  auto read = header->ascii ? readAscii(path, file, *header, points) : readBinary(path, file, *header, points);
  if (!read) return read.error();
  return points;
}

}  // namespace comap
