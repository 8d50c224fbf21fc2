#include "protocol/types/keyframe_link.h"

namespace comap {

KeyframeLink joinLinks(const KeyframeLink& first, const KeyframeLink& second) {
  if (!first.linked || !second.linked) return {};
  KeyframeLink joined;
  joined.linked = true;
  joined.linked_to = first.linked_to;
  joined.T_link_this = first.T_link_this * second.T_link_this;
  // exp(a) T1 exp(b) T2 = exp(a + Ad(T1) b) T1 T2, to first order.
  const Matrix6d Ad = first.T_link_this.adjoint();
  const Matrix6d covariance = first.information.inverse() + Ad * second.information.inverse() * Ad.transpose();
  const Matrix6d information = covariance.inverse();
  joined.information = 0.5 * (information + information.transpose());
  if (!joined.information.allFinite() || joined.information.diagonal().minCoeff() < 0)
    joined.information = Matrix6d::Identity();  // one of them held nothing in some direction: known to a metre
  return joined;
}

}  // namespace comap
