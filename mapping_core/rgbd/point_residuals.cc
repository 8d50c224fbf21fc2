#include "mapping_core/rgbd/point_residuals.h"

#include <algorithm>

#include "mapping_core/rgbd/vector_targets.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mapping_core/rgbd/point_residuals.cc"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

#ifndef COMAP_POINT_RESIDUALS_ONCE
#define COMAP_POINT_RESIDUALS_ONCE
namespace comap {

// All that the loop needs, as plain numbers and pointers.
struct ResidualTask {
  const ReferencePoints* points;
  const float* grey;
  const float* depth_m;
  int width;
  float u_max, v_max, fx, fy, cx, cy;
  float r_rc[9], t_rc[3], r_cr[9], t_cr[3];
  AssociationGates gates;
  Brightness brightness;
  DepthNoiseModel noise;
};

inline constexpr size_t kPointLanes = 8;

}  // namespace comap
#endif

HWY_BEFORE_NAMESPACE();
namespace comap {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, kPointLanes>;
using Ints = hn::RebindToSigned<Floats>;
using F = hn::Vec<Floats>;

struct F3 {
  F x, y, z;
};

HWY_INLINE F3 transform(const float* r, const float* t, const F3& p) {
  const Floats d;
  const auto row = [&](int i) HWY_ATTR {
    return hn::Add(hn::Add(hn::Mul(hn::Set(d, r[i]), p.x), hn::Mul(hn::Set(d, r[i + 1]), p.y)),
                   hn::Add(hn::Mul(hn::Set(d, r[i + 2]), p.z), hn::Set(d, t[i / 3])));
  };
  return {row(0), row(3), row(6)};
}

HWY_INLINE F dot(const F3& a, const F3& b) {
  return hn::Add(hn::Add(hn::Mul(a.x, b.x), hn::Mul(a.y, b.y)), hn::Mul(a.z, b.z));
}

HWY_INLINE F3 cross(const F3& a, const F3& b) {
  return {hn::Sub(hn::Mul(a.y, b.z), hn::Mul(a.z, b.y)), hn::Sub(hn::Mul(a.z, b.x), hn::Mul(a.x, b.z)),
          hn::Sub(hn::Mul(a.x, b.y), hn::Mul(a.y, b.x))};
}

HWY_INLINE F sigmaOf(const DepthNoiseModel& noise, F depth) {
  const Floats d;
  return hn::Add(hn::Set(d, noise.floor_m), hn::Mul(hn::Mul(hn::Set(d, noise.factor_per_m), depth), depth));
}

template <class Mask>
HWY_INLINE void storeRow(const Mask& keep, const F3& front, const F3& back, std::vector<float> (&rows)[6], size_t i) {
  const Floats d;
  const F values[6] = {front.x, front.y, front.z, back.x, back.y, back.z};
  for (size_t c = 0; c < 6; ++c) hn::StoreU(hn::IfThenElseZero(keep, values[c]), d, rows[c].data() + i);
}

ResidualCounts Evaluate(const ResidualTask& task, PointResiduals& out) {
  const Floats d;
  const Ints di;
  const size_t lanes = hn::Lanes(d);
  const ReferencePoints& points = *task.points;
  const auto set = [&](float value) HWY_ATTR { return hn::Set(d, value); };
  const F zero = hn::Zero(d), one = set(1), half = set(0.5f);
  const F fx = set(task.fx), fy = set(task.fy), cx = set(task.cx), cy = set(task.cy);
  const F ifx = set(1 / task.fx), ify = set(1 / task.fy);
  const F extra_square = set(task.gates.extra_sigma_m * task.gates.extra_sigma_m);
  ResidualCounts counts;
  HWY_ALIGN float squares[kPointLanes] = {}, depths[kPointLanes] = {};

  for (size_t i = 0; i < points.x.size(); i += lanes) {
    const auto load = [&](const std::vector<float>& from) HWY_ATTR { return hn::LoadU(d, from.data() + i); };
    const F3 p = {load(points.x), load(points.y), load(points.z)};
    const F3 n = {load(points.nx), load(points.ny), load(points.nz)};
    const F sigma_ref = load(points.sigma_m);
    const F3 q = transform(task.r_cr, task.t_cr, p);
    const auto ahead = hn::Ge(q.z, set(0.05f));
    const F iz = hn::Div(one, hn::IfThenElse(ahead, q.z, one));
    const F u = hn::Add(hn::Mul(hn::Mul(fx, q.x), iz), cx), v = hn::Add(hn::Mul(hn::Mul(fy, q.y), iz), cy);
    const auto visible = hn::And(ahead, hn::And(hn::And(hn::Ge(u, one), hn::Ge(v, one)),
                                                hn::And(hn::Le(u, set(task.u_max)), hn::Le(v, set(task.v_max)))));
    counts.visible += hn::CountTrue(d, visible);
    // Pixel (1, 1) stands in for all that is out of sight, so that every gather stays within the image.
    const F us = hn::IfThenElse(visible, u, one), vs = hn::IfThenElse(visible, v, one);
    const auto width = hn::Set(di, task.width);
    const auto un = hn::ConvertTo(di, hn::Add(us, half)), vn = hn::ConvertTo(di, hn::Add(vs, half));
    const F depth = hn::GatherIndex(d, task.depth_m, hn::Add(hn::Mul(vn, width), un));
    const auto measured = hn::And(visible, hn::Gt(depth, zero));
    const F sigma_live = sigmaOf(task.noise, depth);

    // Point to plane.
    const auto has_normal = hn::Gt(dot(n, n), half);
    const auto compared = hn::And(measured, has_normal);
    counts.compared += hn::CountTrue(d, compared);
    const F3 x_cur = {hn::Mul(hn::Mul(hn::Sub(hn::ConvertTo(d, un), cx), ifx), depth),
                      hn::Mul(hn::Mul(hn::Sub(hn::ConvertTo(d, vn), cy), ify), depth), depth};
    const F3 x_ref = transform(task.r_rc, task.t_rc, x_cur);
    const F3 offset = {hn::Sub(x_ref.x, p.x), hn::Sub(x_ref.y, p.y), hn::Sub(x_ref.z, p.z)};
    const auto near = hn::Lt(dot(offset, offset), set(task.gates.distance_m * task.gates.distance_m));
    const F square_range = hn::Max(dot(x_ref, x_ref), set(1e-12f));
    const F along = dot(n, x_ref);
    const F along_square = hn::Div(hn::Mul(along, along), square_range);
    const F variance = hn::Add(
        hn::Add(hn::Mul(sigma_ref, sigma_ref), hn::Mul(along_square, hn::Mul(sigma_live, sigma_live))), extra_square);
    const F inverse_sigma = hn::Div(one, hn::Sqrt(hn::Max(variance, set(1e-12f))));
    const F residual = hn::Mul(dot(n, offset), inverse_sigma);
    const F share = hn::Mul(residual, set(1 / task.gates.tukey_sigma));
    const F falloff = hn::Sub(one, hn::Mul(share, share));
    const auto inlier = hn::And(hn::And(compared, near), hn::Gt(falloff, zero));
    counts.inliers += hn::CountTrue(d, inlier);
    const F kept_residual = hn::IfThenElseZero(inlier, residual);
    hn::StoreU(kept_residual, d, out.rg.data() + i);
    hn::StoreU(hn::IfThenElseZero(inlier, hn::Mul(falloff, falloff)), d, out.wg.data() + i);
    const F3 moment = cross(x_ref, n);
    storeRow(inlier, {hn::Mul(n.x, inverse_sigma), hn::Mul(n.y, inverse_sigma), hn::Mul(n.z, inverse_sigma)},
             {hn::Mul(moment.x, inverse_sigma), hn::Mul(moment.y, inverse_sigma), hn::Mul(moment.z, inverse_sigma)},
             out.jg, i);
    const size_t lane = i % kPointLanes;
    hn::Store(hn::Add(hn::Load(d, squares + lane), hn::Mul(kept_residual, kept_residual)), d, squares + lane);
    hn::Store(hn::Add(hn::Load(d, depths + lane), hn::IfThenElseZero(inlier, depth)), d, depths + lane);

    // Brightness, where the depths agree.
    const F depth_gate =
        task.gates.photometric_m > 0
            ? set(task.gates.photometric_m)
            : hn::Max(set(0.03f), hn::Mul(set(task.gates.photometric_sigma),
                                          hn::Add(hn::Add(sigma_live, sigma_ref), set(task.gates.extra_sigma_m))));
    const auto photometric = hn::And(measured, hn::Lt(hn::Abs(hn::Sub(depth, q.z)), depth_gate));
    counts.photometric += hn::CountTrue(d, photometric);
    const auto u0 = hn::ConvertTo(di, us), v0 = hn::ConvertTo(di, vs);
    const F a = hn::Sub(us, hn::ConvertTo(d, u0)), b = hn::Sub(vs, hn::ConvertTo(d, v0));
    const auto at = hn::Add(hn::Mul(v0, width), u0);
    const F i00 = hn::GatherIndex(d, task.grey, at), i10 = hn::GatherIndex(d, task.grey + 1, at);
    const F i01 = hn::GatherIndex(d, task.grey + task.width, at),
            i11 = hn::GatherIndex(d, task.grey + task.width + 1, at);
    const F a1 = hn::Sub(one, a), b1 = hn::Sub(one, b);
    const F value = hn::Add(hn::Mul(b1, hn::Add(hn::Mul(a1, i00), hn::Mul(a, i10))),
                            hn::Mul(b, hn::Add(hn::Mul(a1, i01), hn::Mul(a, i11))));
    // Gradient of the interpolated image itself, which is what the residual is made of.
    const F gx = hn::Add(hn::Mul(b1, hn::Sub(i10, i00)), hn::Mul(b, hn::Sub(i11, i01)));
    const F gy = hn::Add(hn::Mul(a1, hn::Sub(i01, i00)), hn::Mul(a, hn::Sub(i11, i10)));
    const F expected = hn::Add(hn::Mul(set(task.brightness.gain), load(points.grey)), set(task.brightness.bias));
    hn::StoreU(hn::IfThenElseZero(photometric, hn::Sub(value, expected)), d, out.rp.data() + i);
    hn::StoreU(hn::IfThenElseZero(photometric, one), d, out.wp.data() + i);
    hn::StoreU(hn::Add(hn::Mul(gx, load(points.gx)), hn::Mul(gy, load(points.gy))), d, out.gradient.data() + i);
    const F gu = hn::Mul(hn::Mul(gx, fx), iz), gv = hn::Mul(hn::Mul(gy, fy), iz);
    const F gz = hn::Neg(hn::Mul(hn::Add(hn::Mul(gu, q.x), hn::Mul(gv, q.y)), iz));
    constexpr float kOrigin[3] = {0, 0, 0};
    const F3 slope = transform(task.r_rc, kOrigin, {gu, gv, gz});
    const F3 front = {hn::Neg(slope.x), hn::Neg(slope.y), hn::Neg(slope.z)};
    storeRow(photometric, front, cross(p, front), out.jp, i);
  }
  for (size_t l = 0; l < kPointLanes; ++l) {
    counts.inlier_square_sum += squares[l];
    counts.depth_sum += depths[l];
  }
  return counts;
}

void Weigh(size_t points, const PhotometricWeights& weights, PointResiduals& residuals) {
  const Floats d;
  const F zero = hn::Zero(d), one = hn::Set(d, 1);
  const F inverse_scale = hn::Set(d, 1 / weights.scale), limit = hn::Set(d, weights.huber);
  const F full = hn::Set(d, weights.weight / (weights.scale * weights.scale));
  const F least = hn::Set(d, weights.least_gradient_square);
  for (size_t i = 0; i < points; i += hn::Lanes(d)) {
    const F share = hn::Mul(hn::Abs(hn::LoadU(d, residuals.rp.data() + i)), inverse_scale);
    const F tapered = hn::Mul(full, hn::Div(limit, hn::Max(share, limit)));
    const F gradient = hn::LoadU(d, residuals.gradient.data() + i);
    const auto used = hn::And(hn::Gt(hn::LoadU(d, residuals.wp.data() + i), zero), hn::Gt(gradient, least));
    const F signal = hn::Sub(one, hn::Div(least, hn::IfThenElse(used, gradient, one)));
    hn::StoreU(hn::IfThenElseZero(used, hn::Mul(tapered, signal)), d, residuals.wp.data() + i);
  }
}

// a: upper triangle row by row, 21 x 8 lanes; b: 6 x 8 lanes.
void Sum(size_t points, const std::vector<float> (&rows)[6], const std::vector<float>& r, const std::vector<float>& w,
         float* HWY_RESTRICT a, float* HWY_RESTRICT b) {
  const Floats d;
  for (size_t i = 0; i < points; i += hn::Lanes(d)) {
    const size_t lane = i % kPointLanes;
    const F weight = hn::LoadU(d, w.data() + i), residual = hn::LoadU(d, r.data() + i);
    const F j[6] = {hn::LoadU(d, rows[0].data() + i), hn::LoadU(d, rows[1].data() + i),
                    hn::LoadU(d, rows[2].data() + i), hn::LoadU(d, rows[3].data() + i),
                    hn::LoadU(d, rows[4].data() + i), hn::LoadU(d, rows[5].data() + i)};
    float* sum = a + lane;
    for (size_t p = 0; p < 6; ++p) {
      const F wj = hn::Mul(weight, j[p]);
      float* right = b + p * kPointLanes + lane;
      hn::Store(hn::Add(hn::Load(d, right), hn::Mul(wj, residual)), d, right);
      for (size_t q = p; q < 6; ++q, sum += kPointLanes)
        hn::Store(hn::Add(hn::Load(d, sum), hn::Mul(wj, j[q])), d, sum);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace comap
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace comap {

HWY_EXPORT(Evaluate);
HWY_EXPORT(Weigh);
HWY_EXPORT(Sum);

void PointResiduals::reserve(size_t points) {
  if (rg.size() >= points) return;
  for (auto* column : {&rg, &wg, &rp, &wp, &gradient}) column->resize(points);
  for (auto& column : jg) column.resize(points);
  for (auto& column : jp) column.resize(points);
}

ResidualCounts evaluateResiduals(const ReferencePoints& points, const PyramidLevel& frame, const Pose& T_ref_cur,
                                 const AssociationGates& gates, const Brightness& brightness,
                                 const DepthNoiseModel& noise, PointResiduals& out) {
  ResidualTask task;
  task.points = &points;
  task.grey = frame.grey.data();
  task.depth_m = frame.depth_m.data();
  task.width = frame.grey.width();
  task.u_max = static_cast<float>(task.width) - 2.001f;
  task.v_max = static_cast<float>(frame.grey.height()) - 2.001f;
  task.fx = static_cast<float>(frame.camera.fx);
  task.fy = static_cast<float>(frame.camera.fy);
  task.cx = static_cast<float>(frame.camera.cx);
  task.cy = static_cast<float>(frame.camera.cy);
  const Eigen::Matrix3f r_rc = T_ref_cur.rotationMatrix().cast<float>();
  const Eigen::Vector3f t_rc = T_ref_cur.translation().cast<float>();
  const Eigen::Vector3f t_cr = -(r_rc.transpose() * t_rc);
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      task.r_rc[3 * row + column] = r_rc(row, column);
      task.r_cr[3 * row + column] = r_rc(column, row);
    }
    task.t_rc[row] = t_rc(row);
    task.t_cr[row] = t_cr(row);
  }
  task.gates = gates;
  task.brightness = brightness;
  task.noise = noise;
  out.reserve(points.x.size());
  return HWY_DYNAMIC_DISPATCH(Evaluate)(task, out);
}

void weighPhotometric(size_t points, const PhotometricWeights& weights, PointResiduals& residuals) {
  HWY_DYNAMIC_DISPATCH(Weigh)(points, weights, residuals);
}

NormalEquations sumNormalEquations(size_t points, const PointResiduals& residuals) {
  alignas(64) float a[21 * kPointLanes] = {};
  alignas(64) float b[6 * kPointLanes] = {};
  HWY_DYNAMIC_DISPATCH(Sum)(points, residuals.jg, residuals.rg, residuals.wg, a, b);
  HWY_DYNAMIC_DISPATCH(Sum)(points, residuals.jp, residuals.rp, residuals.wp, a, b);
  const auto addLanes = [](const float* lanes, double& sum) {
    for (size_t l = 0; l < kPointLanes; ++l) sum += lanes[l];
  };
  NormalEquations sums;
  size_t k = 0;
  for (int p = 0; p < 6; ++p) {
    addLanes(b + static_cast<size_t>(p) * kPointLanes, sums.b(p));
    for (int q = p; q < 6; ++q, ++k) {
      addLanes(a + k * kPointLanes, sums.a(p, q));
      sums.a(q, p) = sums.a(p, q);
    }
  }
  return sums;
}

}  // namespace comap
#endif
