// How far apart the pictures of a stream are.
#pragma once

#include <cstdint>
#include <optional>

namespace comap {

/// The shortest gap of late: pictures that were lost make a gap longer, nothing makes it shorter. A stream that becomes
/// slower is followed by 2 % a picture.
class StreamPeriod {
 public:
  /// A picture's stamp; one that is not after the stamp before tells nothing.
  void add(int64_t stamp_ns);

  /// 0 until two pictures came.
  int64_t period_ns() const { return period_ns_; }

 private:
  std::optional<int64_t> last_ns_;
  int64_t period_ns_ = 0;
};

}  // namespace comap
