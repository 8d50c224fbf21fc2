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

Revocations::News Revocations::look(std::time_t now) {
  const Stamp stamp = stampNow();
  const bool settled = stamp == seen_;  // a copy under way is not judged
  seen_ = stamp;
  if (!settled) return News::kNone;
  const bool is_new = !(stamp == judged_);
  const bool expired = expires_ != 0 && now > expires_;
  // Who is barred looks at all its files: they may be new ones, of another key.
  if (!is_new && barred_.empty()) return expired ? renew(now) : News::kNone;
  judged_ = stamp;
  const auto facts = factsOf(files_, now);
  if (!facts) return keepOn("cannot be used: " + facts.error().text, is_new);
  return judge(*facts, is_new);
}

Revocations::News Revocations::judge(const CertificateFacts& facts, bool is_new) {
  if (facts.revoked) return bar(facts);
  if (!facts.refusal.empty()) return keepOn("cannot be used: " + facts.refusal, is_new);
  const auto missing = std::count_if(revoked_.begin(), revoked_.end(),
                                     [&](const auto& serial) { return !facts.all_revoked.contains(serial); });
  if (missing > 0 && announcedAuthority(files_) == authority_)
    return keepOn(
        "is older: " + files_.revoked + " lacks " + std::to_string(missing) + " certificates that are revoked already",
        is_new);
  return follow(facts);
}

// The certificate in force has expired: it is told once, and a new one in the folder is followed when it is whole.
Revocations::News Revocations::renew(std::time_t now) {
  const auto facts = factsOf(files_, now);
  if (facts && facts->refusal.empty() && checkCredentials(files_, now)) return judge(*facts, true);
  if (!facts || expiry_told_) return News::kNone;
  expiry_told_ = true;
  notice_("link.keys: " + facts->refusal +
          ", and put them into this folder; who is connected stays so, but nobody lets this program in anew");
  return News::kNone;
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
  const bool again = !barred_.empty(), renewed = expiry_told_ && facts.expires > expires_;
  if (!again && !renewed && facts.all_revoked == revoked_) return News::kNone;
  const auto more = std::count_if(facts.all_revoked.begin(), facts.all_revoked.end(),
                                  [&](const auto& serial) { return !revoked_.contains(serial); });
  if (!holdOn(facts)) return News::kNone;
  barred_.clear();
  notice_(again     ? "link.keys: the key counts again: joining anew"
          : renewed ? "link.keys: " + files_.certificate + " is new, until " + facts.valid_until + ": joining anew"
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
  expires_ = facts.expires;
  expiry_told_ = false;
  return true;
}

}  // namespace comap
