#include "mapping_core/rgbd/constraints.h"

#include <Eigen/Geometry>

#include "mapping_core/rgbd/residuals.h"
#include "mapping_core/rgbd/surface_normal.h"

namespace comap {
Matrix6d sumConstraints(const ReferencePoints& points, const PyramidLevel& frame, const Pose& T_ref_cur,
                        const DepthNoiseModel& noise, float extra_sigma_m, const PointResiduals& residuals) {
  const Eigen::Matrix3f r_rc = T_ref_cur.rotationMatrix().cast<float>();
  const Eigen::Vector3f t_rc = T_ref_cur.translation().cast<float>();
  const float fx = static_cast<float>(frame.camera.fx), fy = static_cast<float>(frame.camera.fy);
  const float cx = static_cast<float>(frame.camera.cx), cy = static_cast<float>(frame.camera.cy);
  const int reach = normalReach(points.level);
  Eigen::Matrix<float, 6, 6> sum = Eigen::Matrix<float, 6, 6>::Zero();
  for (size_t i = 0; i < points.count; ++i) {
    if (residuals.wg[i] == 0 && residuals.wp[i] == 0) continue;
    const Eigen::Vector3f p(points.x[i], points.y[i], points.z[i]);
    const Eigen::Vector3f q = r_rc.transpose() * (p - t_rc);
    if (q.z() < 0.05f) continue;
    const float u = fx * q.x() / q.z() + cx, v = fy * q.y() / q.z() + cy;
    const int un = static_cast<int>(u + 0.5f), vn = static_cast<int>(v + 0.5f);
    if (un < 1 || vn < 1 || un >= frame.grey.width() - 1 || vn >= frame.grey.height() - 1) continue;
    // Of brightness the weights have left out what is noise; the operator of the reference sees edges run the way they
    // do, which the gradient between four pixels does not.
    const Row6<float> c = photometricJacobian<float>(p, q, r_rc, points.gx[i], points.gy[i], fx, fy);
    sum += residuals.wp[i] * (c.transpose() * c);
    if (residuals.wg[i] == 0) continue;
    const Eigen::Vector3f n_ref(points.nx[i], points.ny[i], points.nz[i]);
    const Eigen::Vector3f n_cur = r_rc * normalAt(frame, un, vn, reach);
    const float sigma_live = noise.sigma(frame.depth_m.at(un, vn));
    const float along = n_ref.dot(p) / p.norm();
    const float variance =
        points.sigma_m[i] * points.sigma_m[i] + along * along * sigma_live * sigma_live + extra_sigma_m * extra_sigma_m;
    const Row6<float> a = geometricJacobian<float>(p, n_ref), b = geometricJacobian<float>(p, n_cur);
    sum += (0.5f * residuals.wg[i] / variance) * (a.transpose() * b + b.transpose() * a);
  }
  return sum.cast<double>();
}

}  // namespace comap
