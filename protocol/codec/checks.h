// Limits on values, the same for both directions. Each function gives what is wrong with `value`, or an empty string.
// Inside the codec only.
#pragma once

#include <string>
#include <vector>

#include "protocol/types/camera.h"
#include "protocol/types/ids.h"
#include "protocol/types/pose.h"
#include "protocol/types/result.h"

namespace comap::codec {

/// Collects the first problem found; `field` names the place in the message.
class Check {
 public:
  explicit Check(std::string message) : message_(std::move(message)) {}

  Check& that(bool ok, const std::string& field, const std::string& found_and_expected);
  Check& robot(const std::string& field, const std::string& value);
  Check& id(const std::string& field, const KeyframeId& value);
  Check& map(const std::string& field, const MapId& value);
  /// Valid UTF-8 without control characters, at most kMaxTextBytes.
  Check& text(const std::string& field, const std::string& value);
  Check& count(const std::string& field, size_t value, size_t limit);
  Check& range(const std::string& field, double value, double low, double high);
  Check& finite(const std::string& field, double value);
  Check& pose(const std::string& field, const Pose& value);
  /// Finite, symmetric, nowhere negative on the diagonal.
  Check& information(const std::string& field, const Matrix6d& value);
  Check& camera(const std::string& field, const CameraModel& value);

  bool ok() const { return problem_.empty(); }
  Error error(ErrorCode code) const { return {code, problem_}; }

 private:
  std::string message_, problem_;
};

}  // namespace comap::codec
