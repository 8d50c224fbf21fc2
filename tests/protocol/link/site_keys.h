// A site's keys in a folder of its own, for tests.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <string>

#include "fleet_tools/keys/keys_folder.h"

namespace comap {

inline Validity validDays(int from, int until) {
  const std::time_t now = std::time(nullptr);
  return {now + from * std::time_t{86400}, now + until * std::time_t{86400}};
}

class SiteKeys {
 public:
  explicit SiteKeys(const std::string& site, Validity validity = validDays(-30, 30)) {
    static int count = 0;
    path_ = (std::filesystem::temp_directory_path() /
             ("comap_keys_" + std::to_string(getpid()) + "_" + std::to_string(++count)))
                .string();
    std::filesystem::remove_all(path_);
    const auto made = makeKeysFolder(path_, site, validity);
    EXPECT_TRUE(made) << (made ? "" : made.error().text);
  }
  ~SiteKeys() { std::filesystem::remove_all(path_); }
  SiteKeys(const SiteKeys&) = delete;
  SiteKeys& operator=(const SiteKeys&) = delete;

  const std::string& path() const { return path_; }
  /// The folder of `name`, made if it is not there.
  std::string of(KeyRole role, const std::string& name, Validity validity = validDays(-1, 30)) {
    const std::string folder = path_ + "/" + name;
    if (std::filesystem::exists(folder)) return folder;
    const auto added = addParticipant(path_, role, name, validity);
    EXPECT_TRUE(added) << (added ? "" : added.error().text);
    return folder;
  }

 private:
  std::string path_;
};

}  // namespace comap
