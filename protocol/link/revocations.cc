#include "protocol/link/revocations.h"

#include <sys/stat.h>

namespace comap {

Revocations::Revocations(const std::string& keys, std::function<void(const std::string&)> notice)
    : files_(credentialsIn(keys)), notice_(std::move(notice)) {
  judged_ = seen_ = stampNow();
  if (const auto facts = factsOf(files_, std::time(nullptr))) revoked_ = facts->all_revoked;
}

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
  const std::string refusal = facts ? facts->refusal : facts.error().text;
  if (facts && facts->revoked) {
    const bool told = !barred_.empty();
    barred_ = refusal + ": nothing is sent or received with it any more";
    if (told) return News::kNone;
    notice_("link.keys: " + barred_);
    return News::kOwnKey;
  }
  if (!refusal.empty()) {
    if (is_new)
      notice_("link.keys: the list of revoked keys has changed and cannot be used: " + refusal +
              "; the one before it stays in force");
    return News::kNone;
  }
  const bool again = !barred_.empty();
  if (!again && facts->all_revoked == revoked_) return News::kNone;
  size_t more = 0;
  for (const std::string& serial : facts->all_revoked) more += revoked_.contains(serial) ? 0 : 1;
  revoked_ = facts->all_revoked;
  barred_.clear();
  notice_(again ? "link.keys: the key counts again: joining anew"
                : "link.keys: " + files_.revoked + " lists " + std::to_string(more) +
                      " certificates more: joining anew, so that whose they are is let in no longer");
  return News::kChanged;
}

}  // namespace comap
