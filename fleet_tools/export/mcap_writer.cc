#include "fleet_tools/export/mcap_writer.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <cassert>

namespace comap {
namespace {

constexpr char kMagic[] = "\x89MCAP0\r\n";
constexpr size_t kMagicBytes = 8;
constexpr size_t kChunkBytes = 1 << 20;
constexpr int kLevel = 3;

enum Opcode : uint8_t {
  kHeader = 1,
  kFooter,
  kSchema,
  kChannel,
  kMessage,
  kChunk,
  kMessageIndex,
  kChunkIndex,
  kStatistics = 0x0b,
  kSummaryOffset = 0x0e,
  kDataEnd = 0x0f
};

// Little-endian numbers; texts, byte strings and lists are preceded by their length in bytes.
class Fields {
 public:
  Fields& u16(uint16_t value) { return number(value, 2); }
  Fields& u32(uint32_t value) { return number(value, 4); }
  Fields& u64(uint64_t value) { return number(value, 8); }
  Fields& text(const std::string& value) { return u32(static_cast<uint32_t>(value.size())).raw(value); }
  Fields& raw(const std::string& value) {
    bytes_ += value;
    return *this;
  }
  const std::string& bytes() const { return bytes_; }
  std::string record(Opcode opcode) const {
    Fields head;
    head.bytes_.push_back(static_cast<char>(opcode));
    return head.u64(bytes_.size()).raw(bytes_).bytes_;
  }

 private:
  Fields& number(uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) bytes_.push_back(static_cast<char>(value >> 8 * i & 0xff));
    return *this;
  }
  std::string bytes_;
};

uint32_t checksum(const std::string& bytes) {
  return static_cast<uint32_t>(crc32_z(0, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

std::string compressed(const std::string& raw) {
  std::string out(ZSTD_compressBound(raw.size()), '\0');
  const size_t size = ZSTD_compress(out.data(), out.size(), raw.data(), raw.size(), kLevel);
  assert(!ZSTD_isError(size));  // the output is large enough by construction
  out.resize(size);
  return out;
}

}  // namespace

void McapWriter::Span::add(uint64_t time_ns) {
  first_ns = std::min(first_ns, time_ns);
  last_ns = std::max(last_ns, time_ns);
}

Result<McapWriter> McapWriter::create(const std::string& path, const std::string& library) {
  std::ofstream file(path, std::ios::binary);
  McapWriter writer(path, std::move(file));
  writer.put(std::string(kMagic, kMagicBytes));
  writer.put(Fields().text("").text(library).record(kHeader));
  if (!writer.file_) return writer.failed();
  return writer;
}

uint16_t McapWriter::addSchema(const std::string& name, const std::string& descriptors) {
  schemas_.push_back({name, descriptors});
  return static_cast<uint16_t>(schemas_.size());
}

uint16_t McapWriter::addChannel(uint16_t schema, const std::string& topic) {
  channels_.push_back({schema, topic, 0});
  told_.push_back(false);
  return static_cast<uint16_t>(channels_.size());
}

Result<void> McapWriter::write(uint16_t channel, uint64_t time_ns, const std::string& data) {
  Channel& to = channels_.at(channel - 1u);
  if (!told_[channel - 1u]) {
    open_ += schemaRecord(to.schema) + channelRecord(channel);
    told_[channel - 1u] = true;
  }
  open_index_[channel].emplace_back(time_ns, open_.size());
  const auto sequence = static_cast<uint32_t>(++to.messages);
  open_ += Fields().u16(channel).u32(sequence).u64(time_ns).u64(time_ns).raw(data).record(kMessage);
  open_span_.add(time_ns);
  span_.add(time_ns);
  return open_.size() >= kChunkBytes ? closeChunk() : Result<void>();
}

Result<void> McapWriter::closeChunk() {
  if (open_.empty()) return {};
  const std::string packed = compressed(open_);
  Chunk chunk{open_span_.first_ns, open_span_.last_ns, at_, 0, packed.size(), open_.size(), 0, {}};
  put(Fields()
          .u64(chunk.first_ns)
          .u64(chunk.last_ns)
          .u64(chunk.raw)
          .u32(checksum(open_))
          .text("zstd")
          .u64(chunk.compressed)
          .raw(packed)
          .record(kChunk));
  chunk.bytes = at_ - chunk.at;
  for (auto& [channel, places] : open_index_) {
    chunk.index_at[channel] = at_;
    std::stable_sort(places.begin(), places.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    Fields list;
    for (const auto& [time_ns, place] : places) list.u64(time_ns).u64(place);
    put(Fields().u16(channel).text(list.bytes()).record(kMessageIndex));
  }
  chunk.index_bytes = at_ - chunk.at - chunk.bytes;
  chunks_.push_back(std::move(chunk));
  open_.clear();
  open_index_.clear();
  open_span_ = {};
  return file_ ? Result<void>() : Result<void>(failed());
}

Result<void> McapWriter::finish() {
  if (auto closed = closeChunk(); !closed) return closed;
  put(Fields().u32(0).record(kDataEnd));

  const uint64_t summary_at = at_;
  std::string summary;
  Fields offsets;
  const auto group = [&](Opcode opcode, const std::string& records) {
    if (records.empty()) return;
    Fields offset;
    offset.raw(std::string(1, static_cast<char>(opcode))).u64(summary_at + summary.size()).u64(records.size());
    offsets.raw(offset.record(kSummaryOffset));
    summary += records;
  };
  std::string schemas, channels, indexes;
  for (size_t i = 1; i <= schemas_.size(); ++i) schemas += schemaRecord(static_cast<uint16_t>(i));
  for (size_t i = 1; i <= channels_.size(); ++i) channels += channelRecord(static_cast<uint16_t>(i));
  for (const Chunk& chunk : chunks_) {
    Fields places;
    for (const auto& [channel, at] : chunk.index_at) places.u16(channel).u64(at);
    indexes += Fields()
                   .u64(chunk.first_ns)
                   .u64(chunk.last_ns)
                   .u64(chunk.at)
                   .u64(chunk.bytes)
                   .text(places.bytes())
                   .u64(chunk.index_bytes)
                   .text("zstd")
                   .u64(chunk.compressed)
                   .u64(chunk.raw)
                   .record(kChunkIndex);
  }
  group(kSchema, schemas);
  group(kChannel, channels);
  group(kStatistics, statistics());
  group(kChunkIndex, indexes);
  const uint64_t offsets_at = summary_at + summary.size();
  // The checksum covers the footer itself, up to the checksum.
  Fields footer;
  footer.u64(summary_at).u64(offsets_at);
  Fields head;
  head.raw(std::string(1, static_cast<char>(kFooter))).u64(footer.bytes().size() + sizeof(uint32_t));
  const std::string covered = summary + offsets.bytes() + head.bytes() + footer.bytes();
  put(covered + Fields().u32(checksum(covered)).bytes());
  put(std::string(kMagic, kMagicBytes));
  file_.close();
  return file_ ? Result<void>() : Result<void>(failed());
}

void McapWriter::put(const std::string& bytes) {
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  at_ += bytes.size();
}

std::string McapWriter::schemaRecord(uint16_t number) const {
  const Schema& schema = schemas_.at(number - 1u);
  return Fields().u16(number).text(schema.name).text("protobuf").text(schema.descriptors).record(kSchema);
}

std::string McapWriter::channelRecord(uint16_t number) const {
  const Channel& channel = channels_.at(number - 1u);
  return Fields().u16(number).u16(channel.schema).text(channel.topic).text("protobuf").text("").record(kChannel);
}

std::string McapWriter::statistics() const {
  uint64_t messages = 0;
  Fields counts;
  for (size_t i = 0; i < channels_.size(); ++i) {
    messages += channels_[i].messages;
    counts.u16(static_cast<uint16_t>(i + 1)).u64(channels_[i].messages);
  }
  return Fields()
      .u64(messages)
      .u16(static_cast<uint16_t>(schemas_.size()))
      .u32(static_cast<uint32_t>(channels_.size()))
      .u32(0)  // attachments
      .u32(0)  // metadata
      .u32(static_cast<uint32_t>(chunks_.size()))
      .u64(messages == 0 ? 0 : span_.first_ns)
      .u64(span_.last_ns)
      .text(counts.bytes())
      .record(kStatistics);
}

}  // namespace comap
