// The write-ahead log beside a store that was not closed: how far it can be read. SQLite reads it to its first frame
// that is not whole, and says nothing of what lies behind.
#pragma once

#include <string>

namespace comap {

struct LogEnd {
  std::string remark;  ///< a log that ends early, as one can whose writer was stopped, or by damage; empty: it does not
  std::string damage;  ///< whole changes lie behind the end, or all of it is passed over; empty: none was seen
};

/// Reads the log of the store at `path` to its end, before anybody has it open to write: who does begins it anew. Of
/// one that a core is writing, nothing is said but what stays so for a while.
LogEnd lookAtLog(const std::string& path);

}  // namespace comap
