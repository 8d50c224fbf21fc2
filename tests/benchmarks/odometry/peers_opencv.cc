// OpenCV's dense odometries, frame to frame with their defaults, as OpenCV's own evaluation sample uses them.
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/rgbd.hpp>
#include <utility>

#include "tests/benchmarks/odometry/clocks.h"
#include "tests/benchmarks/odometry/peers.h"

namespace comap {
namespace {

class OpenCvOdometry final : public Method {
 public:
  OpenCvOdometry(std::string name, cv::Ptr<cv::rgbd::Odometry> odometry)
      : name_(std::move(name)), odometry_(std::move(odometry)) {}

  std::string name() const override { return name_; }

  Step step(const Frame& frame) override {
    auto current = cv::makePtr<cv::rgbd::OdometryFrame>(greyOf(frame.colour), depthOf_m(frame.depth));
    Step step;
    const double cpu = threadCpu_ms(), wall = wall_ms();
    cv::Mat Rt;
    bool aligned = true;
    if (previous_) {
      aligned = odometry_->compute(current, previous_, Rt);
    } else {
      odometry_->prepareFrameCache(current, cv::rgbd::OdometryFrame::CACHE_SRC);
    }
    step.cpu_ms = threadCpu_ms() - cpu;
    step.wall_ms = wall_ms() - wall;
    if (previous_ && aligned) {
      Eigen::Matrix4d T_previous_current;
      for (int row = 0; row < 4; ++row)
        for (int column = 0; column < 4; ++column) T_previous_current(row, column) = Rt.at<double>(row, column);
      T_odom_cam_ = T_odom_cam_ * Pose(Eigen::Matrix3d(T_previous_current.topLeftCorner<3, 3>()),
                                       Eigen::Vector3d(T_previous_current.topRightCorner<3, 1>()));
    }
    previous_ = current;  // its pyramids and normals serve once more
    step.T_odom_cam = T_odom_cam_;
    step.state = aligned ? TrackingState::kOk : TrackingState::kPoor;
    return step;
  }

 private:
  static cv::Mat greyOf(const ColourImage& colour) {
    const cv::Mat rgb(colour.height(), colour.width(), CV_8UC3,
                      const_cast<Rgb*>(colour.data()));  // OpenCV has no view of what is constant; it only reads
    cv::Mat grey;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    return grey;
  }

  static cv::Mat depthOf_m(const DepthImage& depth) {
    const cv::Mat units(depth.height(), depth.width(), CV_16UC1, const_cast<uint16_t*>(depth.data()));
    cv::Mat metres;
    units.convertTo(metres, CV_32FC1, 1 / kDepthUnitsPerMetre);
    metres.setTo(std::numeric_limits<float>::quiet_NaN(), units == 0);
    return metres;
  }

  std::string name_;
  cv::Ptr<cv::rgbd::Odometry> odometry_;
  cv::Ptr<cv::rgbd::OdometryFrame> previous_;
  Pose T_odom_cam_;
};

}  // namespace

std::vector<std::unique_ptr<Method>> makePeers(const CameraModel& camera) {
  cv::setNumThreads(1);
  cv::setUseOptimized(true);
  const cv::Mat matrix = (cv::Mat_<float>(3, 3) << camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1);
  std::vector<std::unique_ptr<Method>> peers;
  peers.push_back(std::make_unique<OpenCvOdometry>("OpenCV Rgbd", cv::rgbd::RgbdOdometry::create(matrix)));
  peers.push_back(std::make_unique<OpenCvOdometry>(kYardstick, cv::rgbd::RgbdICPOdometry::create(matrix)));
  return peers;
}

bool peersBuilt() { return true; }

}  // namespace comap
