// The robot's odometry as the agent runs it: tracking, keyframe decision, keyframe making.
#pragma once

#include "edge_agent/agent_config.h"
#include "tests/benchmarks/odometry/method.h"

namespace comap {

class OurOdometry final : public Method {
 public:
  explicit OurOdometry(const AgentConfig& config)
      : name_(config.odometry.threads == 1 ? "CoMap" : "CoMap x" + std::to_string(config.odometry.threads)),
        keyframe_options_(config.keyframes),
        odometry_(config.odometry) {}

  std::string name() const override { return name_; }
  Step step(const Frame& frame) override;

  /// Called before and after each part of a step ("track", "decide", "keyframe").
  struct Probe {
    virtual ~Probe() = default;
    virtual void begin(const char* part) = 0;
    virtual void end() = 0;
  };
  void attach(Probe* probe) { probe_ = probe; }

 private:
  std::string name_;
  KeyframeOptions keyframe_options_;
  VisualOdometry odometry_;
  int frames_since_keyframe_ = 0;
  Probe* probe_ = nullptr;
};

}  // namespace comap
