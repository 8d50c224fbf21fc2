// Writes frames as a folder in the TUM RGB-D format.
#pragma once

#include <cstdio>
#include <memory>
#include <string>

#include "protocol/types/image.h"
#include "protocol/types/result.h"

namespace comap {

/// What openTum reads back is what was written, to the bit: PNG colour, depth in the project's unit, exact stamps. The
/// lists are complete after each frame, so a recording that is cut off is a shorter recording. Thread rule: one thread.
class TumWriter {
 public:
  /// Makes the folder. kWrongUse if it exists and is not empty, kUnreachable if it cannot be made.
  static Result<TumWriter> create(const std::string& directory);

  /// kUnreachable if the disk does not take it; kWrongUse for another camera than the first frame's, or a stamp that
  /// is not after the one before.
  Result<void> add(const Frame& frame);

  size_t size() const { return frames_; }

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  using File = std::unique_ptr<std::FILE, Close>;
  TumWriter(std::string directory, File list) : directory_(std::move(directory)), list_(std::move(list)) {}
  Result<void> begin(const Frame& frame);

  std::string directory_;
  File list_;
  size_t frames_ = 0;
  CameraModel camera_;
  int64_t last_ns_ = 0;
};

}  // namespace comap
