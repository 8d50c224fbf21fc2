// Keyframes with little in them, and folders that go away.
#pragma once

#include <unistd.h>

#include <filesystem>
#include <random>
#include <string>

#include "edge_agent/uplink/outbox.h"
#include "protocol/types/keyframe.h"

namespace comap {

/// Textured, so that coarser colour is smaller; at x metres along a straight path, linked to the one before.
inline Keyframe keyframeAt(uint64_t session, uint32_t sequence, double x, double x_before) {
  Keyframe keyframe;
  keyframe.id = {"r", session, sequence};
  keyframe.stamp_ns = int64_t{sequence} * 1'000'000'000;
  keyframe.camera = {50, 50, 31.5, 23.5, 64, 48};
  keyframe.colour = ColourImage(64, 48);
  keyframe.depth = DepthImage(64, 48);
  std::mt19937 random(sequence);
  for (size_t i = 0; i < keyframe.colour.size(); ++i) {
    const auto shade = static_cast<uint8_t>(random());
    keyframe.colour.data()[i] = {shade, static_cast<uint8_t>(shade / 2), 40};
  }
  for (size_t i = 0; i < keyframe.depth.size(); ++i) keyframe.depth.data()[i] = 5000;
  keyframe.T_odom_cam = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x, 0, 0));
  keyframe.linked = sequence > 0;
  if (keyframe.linked) {
    keyframe.linked_to = sequence - 1;
    keyframe.T_link_this = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x - x_before, 0, 0));
    keyframe.information = Matrix6d::Identity() * 1e4;
  }
  return keyframe;
}

inline OutboxRow rowOf(const Keyframe& keyframe) {
  OutboxRow row;
  row.key = {keyframe.id.session, keyframe.id.sequence};
  row.T_odom_cam = keyframe.T_odom_cam;
  row.link = {keyframe.linked, keyframe.linked_to, keyframe.T_link_this, keyframe.information};
  row.skipped = keyframe.skipped;
  return row;
}

inline Outbox memoryOutbox() { return std::move(Outbox::inMemory()).value(); }
inline Outbox outboxAt(const std::string& path) { return std::move(Outbox::open(path)).value(); }

/// By value: what a Result holds ends with it.
inline std::vector<OutboxRow> rowsFrom(Outbox& outbox, uint32_t from = 0) {
  return std::move(outbox.rows(5, from, 1000)).value();
}
inline std::vector<uint8_t> bytesOf(Outbox& outbox, const OutboxKey& key) {
  return std::move(outbox.encoded(key)).value();
}

class ScratchFolder {
 public:
  ScratchFolder() {
    static int number = 0;
    path_ = std::filesystem::temp_directory_path() /
            ("comap_outbox_" + std::to_string(getpid()) + "_" + std::to_string(number++));
    std::filesystem::create_directories(path_);
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace comap
