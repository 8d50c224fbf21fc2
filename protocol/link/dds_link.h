// The wire over DDS: comap's topics on one domain, in the partitions of one site.
#pragma once

#include <memory>

#include "protocol/link/dds_options.h"
#include "protocol/link/link.h"
#include "protocol/types/result.h"

namespace comap {

/// kWrongUse for options out of range, kBadData for keys that will not do (in a sentence), kUnreachable if the
/// interface is not there or the domain's ports are taken. With the name of an interface that has no address yet, the
/// link is there and has no peers. publish blocks up to max_blocking_ms while a keyframe reader takes nothing, then
/// kUnreachable. Messages wait in DDS until receive takes them, so a reader that stops stops its writers and does not
/// grow. Closing takes well under a second; after half a minute it is given up, and `notice` told.
Result<std::unique_ptr<Link>> connectDds(const DdsLinkOptions& options);

}  // namespace comap
