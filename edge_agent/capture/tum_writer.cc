#include "edge_agent/capture/tum_writer.h"

#include <spdlog/fmt/fmt.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "edge_agent/capture/image_file.h"
#include "edge_agent/capture/stamp.h"

namespace comap {
namespace {

namespace fs = std::filesystem;

Error cannotWrite(const std::string& path) {
  return {ErrorCode::kUnreachable, path + ": cannot be written: " + std::strerror(errno)};
}

}  // namespace

Result<TumWriter> TumWriter::create(const std::string& directory) {
  std::error_code problem;
  if (fs::exists(directory, problem) && !(fs::is_directory(directory, problem) && fs::is_empty(directory, problem)))
    return Error{ErrorCode::kWrongUse, directory + ": exists and is no empty folder"};
  for (const char* part : {"rgb", "depth"}) {
    fs::create_directories(fs::path(directory) / part, problem);
    if (problem) return Error{ErrorCode::kUnreachable, directory + ": cannot be made: " + problem.message()};
  }
  const std::string list = directory + "/associations.txt";
  File file(std::fopen(list.c_str(), "wb"));
  if (!file) return cannotWrite(list);
  return TumWriter(directory, std::move(file));
}

Result<void> TumWriter::begin(const Frame& frame) {
  camera_ = frame.camera;
  const std::string path = directory_ + "/calibration.txt";
  File file(std::fopen(path.c_str(), "wb"));
  const std::string line = fmt::format("{} {} {} {} {} {} {}\n", camera_.fx, camera_.fy, camera_.cx, camera_.cy,
                                       camera_.width, camera_.height, kDepthUnitsPerMetre);
  if (!file || std::fwrite(line.data(), 1, line.size(), file.get()) != line.size() || std::fflush(file.get()) != 0)
    return cannotWrite(path);
  return {};
}

Result<void> TumWriter::add(const Frame& frame) {
  if (frames_ == 0) {
    if (auto begun = begin(frame); !begun) return begun;
  } else if (frame.camera != camera_) {
    return Error{ErrorCode::kWrongUse, directory_ + ": a frame of another camera or size cannot be added"};
  } else if (frame.stamp_ns <= last_ns_) {
    return Error{ErrorCode::kWrongUse, directory_ + ": a frame of " + formatStamp(frame.stamp_ns) +
                                           " s cannot follow one of " + formatStamp(last_ns_) + " s"};
  }
  const std::string stamp = formatStamp(frame.stamp_ns);
  const std::string colour = "rgb/" + stamp + ".png", depth = "depth/" + stamp + ".png";
  if (auto written = writeColourPng(directory_ + "/" + colour, frame.colour); !written) return written;
  if (auto written = writeDepth16Png(directory_ + "/" + depth, frame.depth); !written) return written;
  const std::string line = fmt::format("{} {} {} {}\n", stamp, colour, stamp, depth);
  if (std::fwrite(line.data(), 1, line.size(), list_.get()) != line.size() || std::fflush(list_.get()) != 0)
    return cannotWrite(directory_ + "/associations.txt");
  ++frames_;
  last_ns_ = frame.stamp_ns;
  return {};
}

}  // namespace comap
