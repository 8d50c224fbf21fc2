#include "mapping_core/surfels/surfel_pool.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string>

#include "mapping_core/surfels/compaction.h"

namespace comap {
namespace {

constexpr size_t kSurfelBytes = 56, kTimesBytes = sizeof(SeenTimes);

Error fileError(const char* what) {
  return {ErrorCode::kUnreachable, std::string("surfels could not ") + what +
                                       " a temporary file: " + std::strerror(errno) + "; TMPDIR names its folder"};
}

template <class Rows>
bool transferRows(Rows& rows, std::FILE* file, const auto& transfer) {
  const auto one = [&](auto& values) {
    return values.empty() || transfer(values.data(), sizeof(values[0]), values.size(), file) == values.size();
  };
  return one(rows.places) && one(rows.shapes) && one(rows.looks) && one(rows.records) && one(rows.times);
}

// A file of the folder that TMPDIR names (std::tmpfile does not ask), without a name, so that it never outlives us.
std::FILE* makeFile() {
  std::error_code none;
  std::string path = (std::filesystem::temp_directory_path(none) / "comap-surfels-XXXXXX").string();
  const int file = none ? -1 : ::mkostemp(path.data(), O_CLOEXEC);
  if (file < 0) return nullptr;
  ::unlink(path.c_str());
  return ::fdopen(file, "w+b");
}

}  // namespace

SurfelChunk::~SurfelChunk() {
  pool.chunks_.erase(this);
  pool.giveBack(std::move(streams));
}

Result<std::shared_ptr<SurfelPool>> SurfelPool::create(gpu::Device& device, size_t memory_bytes, bool timed) {
  std::shared_ptr<SurfelPool> pool(new SurfelPool(device.context(), memory_bytes));
  auto kernels = SurfelKernels::create(pool->context);
  if (!kernels) return kernels.error();
  pool->kernels = *kernels;
  if (timed) {
    auto more = TimedKernels::create(pool->context);
    if (!more) return more.error();
    pool->timed = *more;
  }
  return pool;
}

size_t SurfelPool::surfelBytes() const { return timed ? kSurfelBytes + kTimesBytes : kSurfelBytes; }

Result<SurfelStreams> SurfelPool::take(size_t capacity) {
  for (;;) {
    if (const auto found = spare_.find(capacity); found != spare_.end()) {
      SurfelStreams streams = std::move(found->second);
      spare_.erase(found);
      streams.boxed = 0;
      if (auto cleared = clearTouched(streams); !cleared) return cleared.error();
      return streams;
    }
    Error refusal{ErrorCode::kOutOfMemory, "surfels may take " + std::to_string(memory_bytes_ >> 20) + " MiB"};
    if (memory_bytes_ == 0 || bytes_ + capacity * surfelBytes() <= memory_bytes_) {
      auto made = SurfelStreams::create(context, capacity, timed.has_value());
      if (made) {
        bytes_ += capacity * surfelBytes();
        return made;
      }
      if (made.error().code != ErrorCode::kOutOfMemory) return made.error();
      refusal = made.error();
    }
    if (!spare_.empty()) {
      dropSpare();
      continue;
    }
    const auto sent = sendOneAway();
    if (!sent) return sent.error();
    if (!*sent) {
      refusal.text += "; all other surfels are away already, what one keyframe or view needs does not fit";
      return refusal;
    }
  }
}

// One of each size stays for the next compaction, or the next small map.
void SurfelPool::giveBack(SurfelStreams streams) {
  if (streams.capacity == 0) return;
  const auto [place, kept] = spare_.try_emplace(streams.capacity, std::move(streams));
  if (!kept) release(std::move(streams));
}

void SurfelPool::release(SurfelStreams streams) { bytes_ -= streams.capacity * surfelBytes(); }

void SurfelPool::dropSpare() {
  for (auto& [capacity, streams] : spare_) release(std::move(streams));
  spare_.clear();
}

// The chunk unused for longest; false if this step needs all that are here.
Result<bool> SurfelPool::sendOneAway() {
  SurfelChunk* oldest = nullptr;
  for (SurfelChunk* chunk : chunks_) {
    if (chunk->away || chunk->streams.capacity == 0 || chunk->used >= clock_) continue;
    // Which of several goes does not change any result, only which file holds it.
    if (!oldest || chunk->used < oldest->used) oldest = chunk;
  }
  if (!oldest) return false;
  if (auto noted = noteTouched(*oldest, moment_); !noted) return noted.error();
  const auto rows = readRows(oldest->streams, oldest->rows);
  if (!rows) return rows.error();
  std::unique_ptr<std::FILE, SurfelChunk::CloseFile> file(makeFile());
  if (!file) return fileError("make");
  if (!transferRows(*rows, file.get(), std::fwrite) || std::fflush(file.get()) != 0) return fileError("write");
  oldest->away = std::move(file);
  giveBack(std::move(oldest->streams));
  oldest->streams = {};
  return true;
}

Result<std::unique_ptr<SurfelChunk>> SurfelPool::makeChunk(size_t capacity) {
  auto streams = take(capacity);
  if (!streams) return streams.error();
  auto chunk = std::make_unique<SurfelChunk>(*this);
  chunk->streams = std::move(*streams);
  chunk->capacity = capacity;
  chunk->used = clock_;
  chunk->number = chunks_made_++;
  chunks_.insert(chunk.get());
  return chunk;
}

Result<void> SurfelPool::noteTouched(SurfelChunk& chunk, uint64_t moment) {
  const auto words = chunk.streams.touched.read<uint32_t>(gpu::groupsFor(chunk.rows, kBlockItems));
  if (!words) return words.error();
  bool any = false;
  for (size_t block = 0; block < words->size(); ++block)
    if ((*words)[block] != 0) chunk.moments.mark(block, moment), any = true;
  return any ? clearTouched(chunk.streams) : Result<void>();
}

Result<StreamRows> SurfelPool::rowsOf(const SurfelChunk& chunk, size_t first, size_t count) {
  if (!chunk.away) return readRows(chunk.streams, count, first);
  StreamRows rows;
  rows.places.resize(chunk.rows);
  rows.shapes.resize(chunk.rows);
  rows.looks.resize(chunk.rows);
  rows.records.resize(chunk.rows);
  if (timed) rows.times.resize(chunk.rows);
  std::rewind(chunk.away.get());
  if (!transferRows(rows, chunk.away.get(), std::fread)) return fileError("read");
  const auto cut = [&](auto& values) {
    if (values.empty()) return;
    values.resize(first + count);
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(first));
  };
  cut(rows.places), cut(rows.shapes), cut(rows.looks), cut(rows.records), cut(rows.times);
  return rows;
}

Result<void> SurfelPool::need(SurfelChunk& chunk) {
  chunk.used = clock_;
  if (!chunk.away) return {};
  auto streams = take(chunk.capacity);
  if (!streams) return streams.error();
  const auto rows = rowsOf(chunk);
  auto written = rows ? writeRows(*streams, *rows, 0) : Result<void>(rows.error());
  if (!written) {
    giveBack(std::move(*streams));
    return written;
  }
  chunk.streams = std::move(*streams);
  chunk.away.reset();
  return {};
}

Result<void> SurfelPool::grow(SurfelChunk& chunk, size_t capacity) {
  if (auto done = need(chunk); !done) return done;
  if (capacity <= chunk.capacity) return {};
  if (auto noted = noteTouched(chunk, moment_); !noted) return noted;
  auto larger = take(capacity);
  if (!larger) return larger.error();
  if (auto done = copyRows(context, chunk.streams, chunk.rows, *larger, 0); !done) {
    giveBack(std::move(*larger));
    return done;
  }
  release(std::exchange(chunk.streams, std::move(*larger)));
  chunk.capacity = capacity;
  return {};
}

Result<void> SurfelPool::compact(SurfelChunk& chunk) {
  if (auto done = need(chunk); !done) return done;
  auto target = take(chunk.capacity);
  if (!target) return target.error();
  const auto left = compactStreams(context, kernels, chunk.streams, *target, scratch, chunk.rows);
  if (!left) {
    giveBack(std::move(*target));
    return left.error();
  }
  giveBack(std::exchange(chunk.streams, std::move(*target)));
  chunk.rows = *left;
  chunk.gaps = 0;
  chunk.moments.markAll(chunk.rows, moment_);
  const auto places = chunk.streams.places.read<std::array<float, 4>>(chunk.rows);
  if (!places) return places.error();
  chunk.bounds = {};
  chunk.bounds.extend(*places);
  return {};
}

size_t SurfelPool::chunksAway() const {
  return static_cast<size_t>(std::count_if(chunks_.begin(), chunks_.end(), [](const auto* c) { return !!c->away; }));
}

}  // namespace comap
