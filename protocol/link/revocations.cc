#include "protocol/link/revocations.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <sstream>

namespace comap {
namespace {

std::string contentOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace

// A file without a name, which nobody else changes.
class Revocations::Copy {
 public:
  explicit Copy(const std::string& text) : file_(memfd_create("comap-revoked", MFD_CLOEXEC)) {
    whole_ = file_ >= 0 && write(file_, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  }
  ~Copy() {
    if (file_ >= 0) close(file_);
  }
  Copy(const Copy&) = delete;
  Copy& operator=(const Copy&) = delete;
  bool whole() const { return whole_; }
  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }

 private:
  int file_;
  bool whole_;
};

Revocations::Revocations(const std::string& keys, std::function<void(const std::string&)> notice)
    : files_(credentialsIn(keys)), notice_(std::move(notice)) {
  judged_ = seen_ = stampNow();
  if (const auto facts = factsOf(files_, std::time(nullptr))) holdOn(*facts);
}

std::string Revocations::list() const { return copy_ ? copy_->path() : std::string(); }

Revocations::Stamp Revocations::stampNow() const {
  struct stat status {};
  if (stat(files_.revoked.c_str(), &status) != 0) return {};
  return {status.st_mtim, status.st_size};
}

Revocations::News Revocations::look() {
  const Stamp now = stampNow();
  const bool settled = now == seen_;  // a copy under way is not judged
  seen_ = now;
  // Who is barred looks at all its files: they may be new ones, of another key.
  if (!settled || (now == judged_ && barred_.empty())) return News::kNone;
  const bool is_new = !(now == judged_);
  judged_ = now;
  const auto facts = factsOf(files_, std::time(nullptr));
  if (!facts) return keepOn("cannot be used: " + facts.error().text, is_new);
  if (facts->revoked) return bar(*facts);
  if (!facts->refusal.empty()) return keepOn("cannot be used: " + facts->refusal, is_new);
  const auto missing = std::count_if(revoked_.begin(), revoked_.end(),
                                     [&](const auto& serial) { return !facts->all_revoked.contains(serial); });
  if (missing > 0 && announcedAuthority(files_) == authority_)
    return keepOn(
        "is older: " + files_.revoked + " lacks " + std::to_string(missing) + " certificates that are revoked already",
        is_new);
  return follow(*facts);
}

Revocations::News Revocations::bar(const CertificateFacts& facts) {
  const bool told = !barred_.empty();
  barred_ = facts.refusal + ": nothing is sent or received with it any more";
  revoked_.insert(facts.all_revoked.begin(), facts.all_revoked.end());
  if (told) return News::kNone;
  notice_("link.keys: " + barred_);
  return News::kOwnKey;
}

Revocations::News Revocations::keepOn(const std::string& reason, bool is_new) const {
  if (is_new)
    notice_("link.keys: the list of revoked keys has changed and " + reason + "; the one before it stays in force");
  return News::kNone;
}

Revocations::News Revocations::follow(const CertificateFacts& facts) {
  const bool again = !barred_.empty();
  if (!again && facts.all_revoked == revoked_) return News::kNone;
  const auto more = std::count_if(facts.all_revoked.begin(), facts.all_revoked.end(),
                                  [&](const auto& serial) { return !revoked_.contains(serial); });
  if (!holdOn(facts)) return News::kNone;
  barred_.clear();
  notice_(again ? "link.keys: the key counts again: joining anew"
                : "link.keys: " + files_.revoked + " lists " + std::to_string(more) +
                      " certificates more: joining anew, so that whose they are is let in no longer");
  return News::kChanged;
}

// False if the list is no longer what was judged; it is judged again then.
bool Revocations::holdOn(const CertificateFacts& facts) {
  auto copy = std::make_shared<const Copy>(contentOf(files_.revoked));
  Credentials copied = files_;
  copied.revoked = copy->path();
  const auto again = factsOf(copied, std::time(nullptr));
  if (!copy->whole() || !again || !again->refusal.empty() || again->all_revoked != facts.all_revoked) {
    judged_ = {};
    return false;
  }
  copy_ = std::move(copy);
  revoked_ = facts.all_revoked;
  authority_ = announcedAuthority(files_);
  return true;
}

}  // namespace comap
