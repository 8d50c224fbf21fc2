#include "tests/benchmarks/odometry/allocations.h"

#include <dlfcn.h>
#include <execinfo.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define COMAP_WATCHES_HEAP 0
#else
#define COMAP_WATCHES_HEAP 1
#endif

namespace {

constexpr int kDepth = 16, kHook = 2;  // calls noted of a place; the innermost two are the hook itself

struct RawPlace {
  const char* part;
  int depth;
  std::array<void*, kDepth> calls;
  uint64_t allocations, bytes;
};

// Fixed memory: whoever watches the heap must not use it.
struct Watch {
  const char* part = nullptr;  // none: not watching
  bool places = false, inside = false;
  uint64_t allocations = 0, bytes = 0;
  std::array<RawPlace, 256> found;
  size_t found_count = 0;
};
Watch g_watch;
thread_local bool t_watched = false;

void notePlace(size_t bytes) {
  RawPlace now{g_watch.part, 0, {}, 1, bytes};
  now.depth = backtrace(now.calls.data(), kDepth);
  for (size_t i = 0; i < g_watch.found_count; ++i) {
    RawPlace& known = g_watch.found[i];
    if (known.part == now.part && known.calls == now.calls) {
      ++known.allocations;
      known.bytes += bytes;
      return;
    }
  }
  if (g_watch.found_count < g_watch.found.size()) g_watch.found[g_watch.found_count++] = now;
}

[[maybe_unused]] void note(size_t bytes) {
  if (!t_watched || g_watch.inside) return;
  ++g_watch.allocations;
  g_watch.bytes += bytes;
  if (!g_watch.places) return;
  g_watch.inside = true;
  notePlace(bytes);
  g_watch.inside = false;
}

std::string nameOf(void* address) {
  Dl_info info{};
  if (dladdr(address, &info) == 0 || info.dli_fname == nullptr) return "?";
  const auto offset = static_cast<const char*>(address) - static_cast<const char*>(info.dli_fbase) - 1;
  char command[512];
  std::snprintf(command, sizeof command, "addr2line -f -C -e '%s' %#tx 2>/dev/null", info.dli_fname, offset);
  char line[512] = "";
  if (std::FILE* pipe = popen(command, "r"); pipe != nullptr) {
    if (std::fgets(line, sizeof line, pipe) == nullptr) line[0] = '\0';
    pclose(pipe);
  }
  std::string name(line);
  while (!name.empty() && name.back() == '\n') name.pop_back();
  if (name.empty() || name == "??") {
    std::snprintf(command, sizeof command, "%s+%#tx", info.dli_fname, offset);
    name = std::string(command);
  }
  return name;
}

}  // namespace

#if COMAP_WATCHES_HEAP
// glibc lets a program bring its own malloc; these count and hand on. operator new and Eigen end here.
extern "C" {
void* __libc_malloc(size_t);            // NOLINT
void* __libc_calloc(size_t, size_t);    // NOLINT
void* __libc_realloc(void*, size_t);    // NOLINT
void* __libc_memalign(size_t, size_t);  // NOLINT

void* malloc(size_t bytes) {
  note(bytes);
  return __libc_malloc(bytes);
}
void* calloc(size_t count, size_t bytes) {
  note(count * bytes);
  return __libc_calloc(count, bytes);
}
void* realloc(void* old, size_t bytes) {
  note(bytes);
  return __libc_realloc(old, bytes);
}
void* memalign(size_t alignment, size_t bytes) {
  note(bytes);
  return __libc_memalign(alignment, bytes);
}
void* aligned_alloc(size_t alignment, size_t bytes) {
  note(bytes);
  return __libc_memalign(alignment, bytes);
}
int posix_memalign(void** result, size_t alignment, size_t bytes) {
  note(bytes);
  *result = __libc_memalign(alignment, bytes);
  return *result == nullptr ? ENOMEM : 0;
}
}
#endif

namespace comap {

bool canCountAllocations() { return COMAP_WATCHES_HEAP != 0; }

AllocationCounter::AllocationCounter(bool places) : places_wanted_(places) {
  std::array<void*, 4> first;
  backtrace(first.data(), static_cast<int>(first.size()));  // its first call takes memory
}

void AllocationCounter::begin(const char* part) {
  part_ = std::string(part);
  g_watch.part = part;
  g_watch.places = places_wanted_;
  g_watch.allocations = g_watch.bytes = 0;
  t_watched = true;
}

void AllocationCounter::end() {
  t_watched = false;
  Sum& sum = sums_[part_];
  ++sum.runs;
  sum.allocations += g_watch.allocations;
  sum.bytes += g_watch.bytes;
  sum.worst = std::max(sum.worst, g_watch.allocations);
}

void AllocationCounter::reset() {
  sums_.clear();
  g_watch.found_count = 0;
}

std::vector<AllocationCounter::Place> AllocationCounter::places() const {
  std::vector<Place> places;
  for (size_t i = 0; i < g_watch.found_count; ++i) {
    const RawPlace& raw = g_watch.found[i];
    Place place{std::string(raw.part), raw.allocations, raw.bytes, {}};
    for (int k = kHook; k < raw.depth; ++k) {
      place.calls.push_back(nameOf(raw.calls[static_cast<size_t>(k)]));
      if (place.calls.back().find("OurOdometry::step") != std::string::npos) break;
    }
    // Several lines of one function are one place.
    const auto known = std::find_if(places.begin(), places.end(), [&](const Place& other) {
      return other.part == place.part && other.calls == place.calls;
    });
    if (known == places.end()) {
      places.push_back(std::move(place));
    } else {
      known->allocations += place.allocations;
      known->bytes += place.bytes;
    }
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) { return a.allocations > b.allocations; });
  return places;
}

}  // namespace comap
