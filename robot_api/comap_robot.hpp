// The C interface of comap_robot.h, which explains all, for C++17 and newer: handles that free themselves, and errors
// as exceptions. Thin: everything is inline, so that the library's binary interface is that of C alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>

#include "comap_robot.h"

namespace comap_robot_api {

/// `code` is one of the negative COMAP_ROBOT_... values.
class Error : public std::runtime_error {
 public:
  Error(int code, const std::string& text) : std::runtime_error(text), code_(code) {}
  int code() const { return code_; }

 private:
  int code_;
};

/// A run of values that somebody else owns.
template <class T>
class View {
 public:
  View(const T* data, std::size_t size) : data_(data), size_(size) {}
  const T* begin() const { return data_; }
  const T* end() const { return data_ + size_; }
  const T& operator[](std::size_t i) const { return data_[i]; }
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }

 private:
  const T* data_;
  std::size_t size_;
};

/// An answer: the surfels of one box, of one state of the robot's tiles. Thread rule: any number may look at it.
class Surfels {
 public:
  explicit Surfels(comap_robot_surfels* answer) : answer_(answer) {}
  std::uint64_t snapshot() const { return comap_robot_surfels_snapshot(answer_.get()); }
  std::string map() const { return comap_robot_surfels_map(answer_.get()); }
  View<comap_robot_surfel> surfels() const {
    return {comap_robot_surfels_data(answer_.get()), comap_robot_surfels_count(answer_.get())};
  }
  View<comap_robot_tile> tiles() const {
    return {comap_robot_surfels_tiles(answer_.get()), comap_robot_surfels_tile_count(answer_.get())};
  }

 private:
  struct Free {
    void operator()(comap_robot_surfels* answer) const { comap_robot_surfels_free(answer); }
  };
  std::unique_ptr<comap_robot_surfels, Free> answer_;
};

/// A connection to the robot's agent. Thread rule: one thread at a time. Functions throw Error.
class Robot {
 public:
  explicit Robot(const std::string& path, int timeout_ms = 1000) : robot_(comap_robot_new()) {
    if (!robot_) throw std::bad_alloc();
    check(comap_robot_connect(robot_.get(), path.c_str(), timeout_ms));
  }

  std::string name() const { return comap_robot_name(robot_.get()); }
  std::uint64_t session() const { return comap_robot_session(robot_.get()); }
  bool connected() const { return comap_robot_connected(robot_.get()) != 0; }
  /// After the agent has gone.
  void reconnect(const std::string& path, int timeout_ms = 1000) {
    check(comap_robot_connect(robot_.get(), path.c_str(), timeout_ms));
  }

  /// Nothing before the first frame was tracked.
  std::optional<comap_robot_pose> latestPose() {
    comap_robot_pose pose{};
    pose.size = sizeof pose;
    if (check(comap_robot_latest_pose(robot_.get(), &pose)) != COMAP_ROBOT_OK) return std::nullopt;
    return pose;
  }

  /// A pose newer than `after`, a sequence; nothing if none comes in `timeout_ms`.
  std::optional<comap_robot_pose> waitPose(std::uint64_t after, int timeout_ms) {
    comap_robot_pose pose{};
    pose.size = sizeof pose;
    pose.sequence = after;
    if (check(comap_robot_wait_pose(robot_.get(), &pose, timeout_ms)) != COMAP_ROBOT_OK) return std::nullopt;
    return pose;
  }

  /// Nothing if the tiles are still those of `known_snapshot`.
  std::optional<Surfels> readSurfels(const comap_robot_box& box, std::uint64_t known_snapshot = 0,
                                     std::uint64_t most_surfels = 0, int timeout_ms = 5000) {
    comap_robot_surfels* answer = nullptr;
    const int code =
        check(comap_robot_read_surfels(robot_.get(), &box, known_snapshot, most_surfels, timeout_ms, &answer));
    if (code != COMAP_ROBOT_OK) return std::nullopt;
    return Surfels(answer);
  }

 private:
  int check(int code) const {
    if (code < 0) throw Error(code, comap_robot_error(robot_.get()));
    return code;
  }
  struct Free {
    void operator()(comap_robot* robot) const { comap_robot_free(robot); }
  };
  std::unique_ptr<comap_robot, Free> robot_;
};

}  // namespace comap_robot_api
