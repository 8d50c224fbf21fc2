#include "edge_agent/odometry/super_keyframe.h"

#include <algorithm>

#include "mapping_core/rgbd/row_workers.h"
#include "mapping_core/rgbd/vector_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "edge_agent/odometry/super_keyframe.cc"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

#ifndef COMAP_SUPER_KEYFRAME_ONCE
#define COMAP_SUPER_KEYFRAME_ONCE
namespace comap {

inline constexpr int32_t kHits = 0xff;          // bits of the number of frames that agree
inline constexpr int32_t kSeenThrough = 0x100;  // one frame that saw through
inline constexpr int32_t kFilled = 0x1000000;   // the keyframe itself had a hole here
inline constexpr float kGateSigma = 3;

struct WarpTask {
  const float* depth_m;  // of the frame
  int width, height;
  float fx, fy, cx, cy;
  float r_cam_key[9], t_cam_key[3];
  float back[4];  // third row of T_key_cam: depth in the keyframe
  DepthNoiseModel noise;
  float frames;  // as how many frames it counts
  int32_t hits;  // and as how many hits
  float* inverse_depth;
  float* weight;
  int32_t* counts;
};

}  // namespace comap
#endif

HWY_BEFORE_NAMESPACE();
namespace comap {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

void Average(const WarpTask& task, int first_row, int end_row) {
  const hn::CappedTag<float, 8> d;
  const hn::RebindToSigned<decltype(d)> di;
  using F = hn::Vec<decltype(d)>;
  const size_t lanes = hn::Lanes(d);
  const auto set = [&](float value) HWY_ATTR { return hn::Set(d, value); };
  const F one = set(1), half = set(0.5f), zero = hn::Zero(d);
  // Half a pixel belongs to the outermost ones on either side.
  const F least = set(-0.49f), u_max = set(static_cast<float>(task.width) - 0.51f),
          v_max = set(static_cast<float>(task.height) - 0.51f);
  const F iota = hn::ConvertTo(d, hn::Iota(di, 0));
  const float* r = task.r_cam_key;
  for (int y = first_row; y < end_row; ++y) {
    const size_t row = static_cast<size_t>(y) * static_cast<size_t>(task.width);
    const float ray_y = (static_cast<float>(y) - task.cy) / task.fy;
    // What a row's rays have in common.
    const F base_x = set(r[1] * ray_y + r[2]), base_y = set(r[4] * ray_y + r[5]), base_z = set(r[7] * ray_y + r[8]);
    for (size_t x = 0; x < static_cast<size_t>(task.width); x += lanes) {
      const size_t i = row + x;
      const F rho = hn::LoadU(d, task.inverse_depth + i);
      const F column = hn::Add(iota, set(static_cast<float>(x)));
      const auto known = hn::And(hn::Gt(rho, zero), hn::Lt(column, set(static_cast<float>(task.width))));
      if (hn::AllFalse(d, known)) continue;
      const F z = hn::Div(one, hn::IfThenElse(known, rho, one));
      const F ray_x = hn::Mul(hn::Sub(column, set(task.cx)), set(1 / task.fx));
      const F qx = hn::Add(hn::Mul(hn::Add(hn::Mul(set(r[0]), ray_x), base_x), z), set(task.t_cam_key[0]));
      const F qy = hn::Add(hn::Mul(hn::Add(hn::Mul(set(r[3]), ray_x), base_y), z), set(task.t_cam_key[1]));
      const F qz = hn::Add(hn::Mul(hn::Add(hn::Mul(set(r[6]), ray_x), base_z), z), set(task.t_cam_key[2]));
      const auto ahead = hn::And(known, hn::Gt(qz, set(0.05f)));
      const F iz = hn::Div(one, hn::IfThenElse(ahead, qz, one));
      const F u = hn::Add(hn::Mul(hn::Mul(qx, iz), set(task.fx)), set(task.cx));
      const F v = hn::Add(hn::Mul(hn::Mul(qy, iz), set(task.fy)), set(task.cy));
      const auto visible = hn::And(
          ahead, hn::And(hn::And(hn::Ge(u, least), hn::Ge(v, least)), hn::And(hn::Le(u, u_max), hn::Le(v, v_max))));
      const auto un = hn::ConvertTo(di, hn::Add(hn::IfThenElseZero(visible, u), half));
      const auto vn = hn::ConvertTo(di, hn::Add(hn::IfThenElseZero(visible, v), half));
      const F live = hn::GatherIndex(d, task.depth_m, hn::Add(hn::Mul(vn, hn::Set(di, task.width)), un));
      const auto measured = hn::And(visible, hn::Gt(live, zero));
      // The live point on the ray of the pixel it was compared at, seen from the keyframe.
      const F stretch = hn::Mul(live, iz);
      const F back = hn::Add(
          hn::Add(hn::Mul(set(task.back[0]), hn::Mul(qx, stretch)), hn::Mul(set(task.back[1]), hn::Mul(qy, stretch))),
          hn::Add(hn::Mul(set(task.back[2]), live), set(task.back[3])));
      const auto usable = hn::And(measured, hn::Gt(back, set(0.05f)));
      const F rho_live = hn::Div(one, hn::IfThenElse(usable, back, one));
      const F sigma =
          hn::Add(hn::Mul(set(task.noise.floor_m), hn::Mul(rho_live, rho_live)), set(task.noise.factor_per_m));
      const F weight_live = hn::Div(set(task.frames), hn::Mul(sigma, sigma));
      const F weight = hn::LoadU(d, task.weight + i);
      const F all = hn::Add(weight, weight_live);
      const F difference = hn::Sub(rho_live, rho);
      // Variance of the difference: 1/w_live + 1/w.
      const F gate =
          hn::Div(hn::Mul(set(kGateSigma * kGateSigma), all), hn::Mul(weight_live, hn::Max(weight, set(1e-12f))));
      const auto agrees = hn::And(usable, hn::Lt(hn::Mul(difference, difference), gate));
      const auto through = hn::AndNot(agrees, hn::And(usable, hn::Lt(difference, zero)));
      const F mean = hn::Add(rho, hn::Mul(difference, hn::Div(weight_live, all)));
      hn::StoreU(hn::IfThenElse(agrees, mean, rho), d, task.inverse_depth + i);
      hn::StoreU(hn::IfThenElse(agrees, all, weight), d, task.weight + i);
      const auto counted = hn::IfThenElseZero(hn::RebindMask(di, agrees), hn::Set(di, task.hits));
      const auto contradicted = hn::IfThenElseZero(hn::RebindMask(di, through), hn::Set(di, kSeenThrough));
      hn::StoreU(hn::Add(hn::LoadU(di, task.counts + i), hn::Add(counted, contradicted)), di, task.counts + i);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace comap
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace comap {

HWY_EXPORT(Average);

namespace {

// In one window; counts stay within their bits.
constexpr int kMostFrames = 200;
// Room behind the last row, so that whole vectors may be loaded there.
constexpr size_t kPadding = 8;

float weightOf(float inverse_depth, const DepthNoiseModel& noise) {
  const float sigma = noise.floor_m * inverse_depth * inverse_depth + noise.factor_per_m;
  return 1 / (sigma * sigma);
}

}  // namespace

void SuperKeyframe::start(const PyramidLevel& keyframe) {
  camera_ = keyframe.camera;
  const size_t pixels = keyframe.depth_m.size();
  inverse_depth_.assign(pixels + kPadding, 0.0f);
  weight_.assign(pixels + kPadding, 0.0f);
  counts_.assign(pixels + kPadding, 0);
  hole_pixels_.resize(pixels);
  shareRows(workers_, camera_.height, [&](int begin, int end) {
    const size_t width = static_cast<size_t>(camera_.width);
    for (size_t i = static_cast<size_t>(begin) * width; i < static_cast<size_t>(end) * width; ++i) {
      const float z = keyframe.depth_m.data()[i];
      if (z <= 0) continue;
      inverse_depth_[i] = 1 / z;
      weight_[i] = weightOf(1 / z, noise_);
      counts_[i] = 1;
    }
  });
  frames_ = 1;
}

void SuperKeyframe::add(const PyramidLevel& frame, const Pose& T_keyframe_cam) {
  if (frames_ == 0 || frames_ >= kMostFrames) return;
  average(frame, T_keyframe_cam, 1, 1);
  ++frames_;
  // Holes change slowly: frames 2, 4, 8 and so on are enough to fill them.
  if ((frames_ & (frames_ - 1)) == 0) fillHoles(frame, T_keyframe_cam);
}

void SuperKeyframe::inherit(const PyramidLevel& before, const Pose& T_keyframe_before, float frames) {
  average(before, T_keyframe_before, frames, 0);
  fillHoles(before, T_keyframe_before);
}

void SuperKeyframe::average(const PyramidLevel& frame, const Pose& T_keyframe_cam, float frames, int32_t hits) {
  if (frame.depth_m.width() != camera_.width || frame.depth_m.height() != camera_.height) return;
  WarpTask task;
  task.depth_m = frame.depth_m.data();
  task.width = camera_.width;
  task.height = camera_.height;
  task.fx = static_cast<float>(camera_.fx);
  task.fy = static_cast<float>(camera_.fy);
  task.cx = static_cast<float>(camera_.cx);
  task.cy = static_cast<float>(camera_.cy);
  const Eigen::Matrix3f r_key_cam = T_keyframe_cam.rotationMatrix().cast<float>();
  const Eigen::Vector3f t_key_cam = T_keyframe_cam.translation().cast<float>();
  const Eigen::Vector3f t_cam_key = -(r_key_cam.transpose() * t_key_cam);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) task.r_cam_key[3 * row + column] = r_key_cam(column, row);
    task.t_cam_key[row] = t_cam_key(row);
    task.back[row] = r_key_cam(2, row);
  }
  task.back[3] = t_key_cam(2);
  task.noise = noise_;
  task.frames = frames;
  task.hits = hits;
  task.inverse_depth = inverse_depth_.data();
  task.weight = weight_.data();
  task.counts = counts_.data();
  // Where a row does not end with a whole vector, its last one reaches into the next row, which then must not be
  // another thread's.
  RowWorkers* workers = camera_.width % static_cast<int>(kPadding) == 0 ? workers_ : nullptr;
  shareRows(workers, task.height, [&](int begin, int end) { HWY_DYNAMIC_DISPATCH(Average)(task, begin, end); });
}

void SuperKeyframe::fillHoles(const PyramidLevel& frame, const Pose& T_keyframe_cam) {
  if (frame.depth_m.width() != camera_.width || frame.depth_m.height() != camera_.height) return;
  const Eigen::Matrix3f r = T_keyframe_cam.rotationMatrix().cast<float>();
  const Eigen::Vector3f t = T_keyframe_cam.translation().cast<float>();
  const float fx = static_cast<float>(camera_.fx), fy = static_cast<float>(camera_.fy);
  const float cx = static_cast<float>(camera_.cx), cy = static_cast<float>(camera_.cy);
  const float u_max = static_cast<float>(camera_.width - 1), v_max = static_cast<float>(camera_.height - 1);
  shareRows(workers_, camera_.height, [&](int begin, int end) {
    for (int y = begin; y < end; ++y) {
      const float* depth = frame.depth_m.row(y);
      HolePixel* out = hole_pixels_.data() + static_cast<size_t>(y) * static_cast<size_t>(camera_.width);
      const Eigen::Vector3f base = r.col(1) * ((static_cast<float>(y) - cy) / fy) + r.col(2);
      for (int x = 0; x < camera_.width; ++x) {
        out[x].target = -1;
        if (depth[x] <= 0) continue;
        const Eigen::Vector3f p = (r.col(0) * ((static_cast<float>(x) - cx) / fx) + base) * depth[x] + t;
        if (p.z() < 0.05f) continue;
        const float iz = 1 / p.z();
        const float u = fx * p.x() * iz + cx, v = fy * p.y() * iz + cy;
        if (!(u >= 0 && v >= 0 && u <= u_max && v <= v_max)) continue;
        out[x] = {static_cast<int32_t>(v + 0.5f) * camera_.width + static_cast<int32_t>(u + 0.5f), iz};
      }
    }
  });
  // Several pixels of the frame may fall into one: one after the other, so that the result is always the same.
  for (const HolePixel& pixel : hole_pixels_) {
    if (pixel.target < 0) continue;
    const auto i = static_cast<size_t>(pixel.target);
    const bool empty = counts_[i] == 0;
    const bool nearer =
        counts_[i] == (kFilled | 1) && pixel.inverse_depth > inverse_depth_[i];  // of one frame, the front surface
    if (!empty && !nearer) continue;
    inverse_depth_[i] = pixel.inverse_depth;
    weight_[i] = weightOf(pixel.inverse_depth, noise_);
    counts_[i] = kFilled | 1;
  }
}

bool SuperKeyframe::holds(size_t pixel) const {
  const int32_t hits = counts_[pixel] & kHits;
  const int32_t through = (counts_[pixel] & (kFilled - 1)) / kSeenThrough;
  return hits > ((counts_[pixel] & kFilled) != 0 ? 1 : 0) && hits >= through;
}

void SuperKeyframe::writeDepth(Image<float>& depth_m) const {
  if (depth_m.width() != camera_.width || depth_m.height() != camera_.height)
    depth_m = Image<float>(camera_.width, camera_.height);
  shareRows(workers_, camera_.height, [&](int begin, int end) {
    const size_t width = static_cast<size_t>(camera_.width);
    for (size_t i = static_cast<size_t>(begin) * width; i < static_cast<size_t>(end) * width; ++i)
      depth_m.data()[i] = holds(i) ? 1 / inverse_depth_[i] : 0.0f;
  });
}

void SuperKeyframe::writeHits(Image<uint8_t>& hits) const {
  if (hits.width() != camera_.width || hits.height() != camera_.height)
    hits = Image<uint8_t>(camera_.width, camera_.height);
  for (size_t i = 0; i < hits.size(); ++i) hits.data()[i] = static_cast<uint8_t>(holds(i) ? counts_[i] & kHits : 0);
}

}  // namespace comap
#endif
