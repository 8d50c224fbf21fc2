#include "mapping_core/store/store_log.h"

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

namespace comap {
namespace {

// As SQLite's file format has it: a head, and frames of a head and a page each.
constexpr size_t kHeadBytes = 32, kFrameHeadBytes = 24;
constexpr uint32_t kMagic = 0x377f0682;  // and 1 more where sums are of big-endian words

uint32_t big(const uint8_t* at) { return uint32_t{at[0]} << 24 | uint32_t{at[1]} << 16 | uint32_t{at[2]} << 8 | at[3]; }
uint32_t little(const uint8_t* at) {
  return uint32_t{at[3]} << 24 | uint32_t{at[2]} << 16 | uint32_t{at[1]} << 8 | at[0];
}

struct Sum {
  bool of_big = false;
  uint32_t a = 0, b = 0;
  void add(const uint8_t* bytes, size_t count) {
    for (size_t i = 0; i + 8 <= count; i += 8) {
      a += (of_big ? big(bytes + i) : little(bytes + i)) + b;
      b += (of_big ? big(bytes + i + 4) : little(bytes + i + 4)) + a;
    }
  }
};

// How a log ends.
struct Found {
  uint64_t bytes = 0, frames = 0;  // of the file
  bool head_whole = true;
  uint64_t whole = 0;           // frames up to the first that is not
  uint64_t behind = 0;          // frames of the same round behind those: the one that is not whole among them
  uint64_t changes_behind = 0;  // that were finished
  bool last_finished = false;   // the last of those frames finishes a change
  bool operator==(const Found&) const = default;
};

class LogFile {
 public:
  explicit LogFile(const std::string& path) : file_(path, std::ios::binary) {
    std::error_code none;
    const auto bytes = std::filesystem::file_size(path, none);
    found_.bytes = none ? 0 : bytes;
  }
  Found look() {
    if (found_.bytes == 0) return found_;
    std::array<uint8_t, kHeadBytes> head{};
    found_.head_whole = read(head.data(), head.size()) && begin(head);
    if (!found_.head_whole) return found_;
    found_.frames = (found_.bytes - kHeadBytes + kFrameHeadBytes + page_bytes_ - 1) / (kFrameHeadBytes + page_bytes_);
    std::vector<uint8_t> frame(kFrameHeadBytes + page_bytes_);
    for (;;) {
      const size_t count = readSome(frame.data(), frame.size());
      if (count < kFrameHeadBytes) return found_;
      take(frame, count == frame.size());
    }
  }

 private:
  size_t readSome(uint8_t* to, size_t count) {
    file_.read(reinterpret_cast<char*>(to), static_cast<std::streamsize>(count));
    return static_cast<size_t>(file_.gcount());
  }
  bool read(uint8_t* to, size_t count) { return readSome(to, count) == count; }
  bool begin(const std::array<uint8_t, kHeadBytes>& head) {
    const uint32_t magic = big(head.data());
    page_bytes_ = big(head.data() + 8);
    salts_ = {big(head.data() + 16), big(head.data() + 20)};
    sum_.of_big = (magic & 1) != 0;
    sum_.add(head.data(), 24);
    return (magic & ~1u) == kMagic && page_bytes_ >= 512 && page_bytes_ <= 65536 && sum_.a == big(head.data() + 24) &&
           sum_.b == big(head.data() + 28);
  }
  // Frames of an earlier round may follow: the file does not shrink when it is begun anew.
  void take(const std::vector<uint8_t>& frame, bool complete) {
    const bool ours = big(frame.data() + 8) == salts_[0] && big(frame.data() + 12) == salts_[1];
    const bool finishes = big(frame.data() + 4) != 0;
    if (!ended_ && complete && ours) {
      sum_.add(frame.data(), 8);
      sum_.add(frame.data() + kFrameHeadBytes, page_bytes_);
      if (sum_.a == big(frame.data() + 16) && sum_.b == big(frame.data() + 20)) {
        ++found_.whole;
        return;
      }
    }
    ended_ = true;
    if (!ours) return;
    ++found_.behind;
    found_.changes_behind += complete && finishes;
    found_.last_finished = complete && finishes;
  }

  std::ifstream file_;
  Found found_;
  Sum sum_;
  uint32_t page_bytes_ = 0;
  std::array<uint32_t, 2> salts_{};
  bool ended_ = false;
};

// A change that was being written when its writer stopped is one at the most, and the last.
LogEnd told(const std::string& path, const Found& found) {
  LogEnd end;
  if (found.bytes > 0 && !found.head_whole)
    end.damage = "its log " + path + " is passed over: the head of its " + std::to_string(found.bytes) +
                 " bytes is not whole; what was written to it last is lost";
  if (found.behind == 0) return end;
  const std::string where = "its log " + path + " ends early, after " + std::to_string(found.whole) + " of " +
                            std::to_string(found.frames) + " pages";
  const bool unfinished = found.changes_behind == 0 || (found.changes_behind == 1 && found.last_finished);
  if (unfinished)
    end.remark = where +
                 ": its writer was stopped within a change, which is then as if it had not begun, or the last "
                 "change is damaged";
  else
    end.damage = where + ": the next one is damaged, and " + std::to_string(found.changes_behind) +
                 " finished changes behind it are passed over";
  return end;
}

}  // namespace

LogEnd lookAtLog(const std::string& path) {
  constexpr std::chrono::milliseconds kPause(50);
  const std::string log = path + "-wal";
  for (Found before = LogFile(log).look();;) {
    const LogEnd end = told(log, before);
    if (end.remark.empty() && end.damage.empty()) return end;
    std::this_thread::sleep_for(kPause);
    const Found again = LogFile(log).look();
    if (again == before) return end;
    before = again;
  }
}

}  // namespace comap
