// What becomes of a folder of keys while a program runs: its list of revoked certificates, and the end of its own.
#pragma once

#include <ctime>
#include <functional>
#include <memory>
#include <set>
#include <string>

#include "protocol/keys/credentials.h"

namespace comap {

/// Thread rule: one thread at a time.
class Revocations {
 public:
  /// `keys`: the folder; what it lists now is known. `notice` is told what was found, in a sentence.
  Revocations(const std::string& keys, std::function<void(const std::string&)> notice);

  enum class News {
    kNone,
    kChanged,  ///< others count no longer, or this one counts again or is new: who is connected must prove himself anew
    kOwnKey,   ///< this participant's own certificate is in the list
  };
  /// Looks at the files. A list that cannot be used (half copied, of another authority) or that lacks what the one
  /// before it lists, since it is older, is told, and the one before it stays in force. An own certificate that has
  /// expired is told once: who is connected stays so, but nobody lets this program in anew; a new one is followed.
  News look(std::time_t now = std::time(nullptr));

  /// The path of a copy of the list in force, whatever becomes of the file; empty if there was none to begin with.
  std::string list() const;

  /// Why this participant's own key counts no longer; empty while it does.
  const std::string& barred() const { return barred_; }

 private:
  struct Stamp {
    timespec changed{};
    int64_t bytes = -1;
    bool operator==(const Stamp& other) const {
      return changed.tv_sec == other.changed.tv_sec && changed.tv_nsec == other.changed.tv_nsec && bytes == other.bytes;
    }
  };
  class Copy;
  Stamp stampNow() const;
  News judge(const CertificateFacts& facts, bool is_new);
  News renew(std::time_t now);
  News bar(const CertificateFacts& facts);
  News keepOn(const std::string& reason, bool is_new) const;
  News follow(const CertificateFacts& facts);
  bool holdOn(const CertificateFacts& facts);

  const Credentials files_;
  const std::function<void(const std::string&)> notice_;
  Stamp judged_, seen_;
  std::set<std::string> revoked_;  // serials, of what is in force
  std::string authority_;          // whose serials
  std::shared_ptr<const Copy> copy_;
  std::string barred_;
  std::time_t expires_ = 0;  // of the certificate that the link was opened with
  bool expiry_told_ = false;
};

}  // namespace comap
