// Recordings in the MCAP format (mcap.dev): a stream of records in chunks, with indexes behind them.
#pragma once

#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "protocol/types/result.h"

namespace comap {

/// Chunks are compressed with zstd. Numbers of schemas and channels begin with 1. Thread rule: one thread.
class McapWriter {
 public:
  /// kUnreachable if the file cannot be made.
  static Result<McapWriter> create(const std::string& path, const std::string& library);

  /// A Protobuf message type: its full name, and a serialised FileDescriptorSet with all that it needs.
  uint16_t addSchema(const std::string& name, const std::string& descriptors);
  uint16_t addChannel(uint16_t schema, const std::string& topic);
  /// `data`: the encoded message of the channel's type. In any order of time; readers sort by the indexes.
  Result<void> write(uint16_t channel, uint64_t time_ns, const std::string& data);
  /// Writes the last chunk, the indexes and the end. Nothing may follow.
  Result<void> finish();

 private:
  struct Schema {
    std::string name, descriptors;
  };
  struct Channel {
    uint16_t schema = 0;
    std::string topic;
    uint64_t messages = 0;
  };
  struct Chunk {
    uint64_t first_ns = 0, last_ns = 0, at = 0, bytes = 0, compressed = 0, raw = 0, index_bytes = 0;
    std::map<uint16_t, uint64_t> index_at;  // of each channel's index record
  };
  struct Span {
    uint64_t first_ns = UINT64_MAX, last_ns = 0;
    void add(uint64_t time_ns);
  };

  McapWriter(const std::string& path, std::ofstream file) : path_(path), file_(std::move(file)) {}
  void put(const std::string& bytes);
  Result<void> closeChunk();
  std::string schemaRecord(uint16_t number) const;
  std::string channelRecord(uint16_t number) const;
  std::string statistics() const;
  Error failed() const { return {ErrorCode::kUnreachable, path_ + ": cannot be written"}; }

  std::string path_;
  std::ofstream file_;
  uint64_t at_ = 0;  // bytes written
  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  std::string open_;  // records of the chunk that is being filled
  Span open_span_, span_;
  std::map<uint16_t, std::vector<std::pair<uint64_t, uint64_t>>> open_index_;  // channel -> (time, place in the chunk)
  std::vector<bool> told_;  // channels whose records are in a chunk already
  std::vector<Chunk> chunks_;
};

}  // namespace comap
