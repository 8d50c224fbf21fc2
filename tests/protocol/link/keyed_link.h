// What tests of links with keys have in common.
#pragma once

#include <gmock/gmock.h>

#include <chrono>
#include <fstream>
#include <functional>
#include <memory>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>

#include "protocol/link/dds_link.h"
#include "tests/protocol/link/site_keys.h"

namespace comap {

constexpr const char* kSite = "keyed";

inline int testDomain() { return 100 + getpid() % 121; }

/// What a link told while it was open.
class Notices {
 public:
  std::function<void(const std::string&)> sink() {
    return [this](const std::string& text) {
      const std::lock_guard lock(mutex_);
      text_ += text + "\n";
    };
  }
  std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  /// Whether `part` is told within 20 s, behind the first `after` characters. `meanwhile`: what keeps a link going.
  bool awaits(const std::string& part, size_t after = 0, const std::function<void()>& meanwhile = {}) const {
    const auto told = [&] { return text().find(part, after) != std::string::npos; };
    for (const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
         !told() && std::chrono::steady_clock::now() < until;) {
      if (meanwhile) meanwhile();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return told();
  }

 private:
  mutable std::mutex mutex_;
  std::string text_;
};

inline DdsLinkOptions optionsOf(LinkRole role, const std::string& robot, const std::string& keys) {
  DdsLinkOptions options{testDomain(), kSite, role, robot, "127.0.0.1"};
  options.keys = keys;
  return options;
}

inline std::unique_ptr<Link> open(const DdsLinkOptions& options) {
  auto link = connectDds(options);
  if (!link) ADD_FAILURE() << link.error().text;
  return link ? std::move(*link) : nullptr;
}

inline bool waitForPeers(const Link& link, int count) {
  for (const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(20);
       link.peers() != count && std::chrono::steady_clock::now() < until;)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return link.peers() == count;
}

inline std::string contentOf(const std::string& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

inline void overwrite(const std::string& path, const std::string& content) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
}

inline void replaceIn(const std::string& path, const std::string& from, const std::string& to) {
  std::string text = contentOf(path);
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << path;
  overwrite(path, text.replace(at, from.size(), to));
}

/// A site with keys of which links can be opened.
class KeyedPeers : public testing::Test {
 protected:
  DdsLinkOptions core() { return optionsOf(LinkRole::kCore, "", keys_.of(KeyRole::kCore, "core")); }
  DdsLinkOptions robot(const std::string& name) {
    return optionsOf(LinkRole::kRobot, name, keys_.of(KeyRole::kRobot, name));
  }

  SiteKeys keys_{kSite};
};

}  // namespace comap
