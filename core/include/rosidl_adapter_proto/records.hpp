// The records of a chunk of a recording, in the form of MCAP (https://mcap.dev/spec#records): walked through,
// indexed and made.
//
// A record is an opcode (1 byte), the size of its content (8 bytes) and the content; numbers are little
// endian. Only messages count here, and what else there is is passed over.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "memory.hpp"
#include "transcode.hpp"
#include "wire.hpp"

namespace rosidl_proto {

constexpr uint8_t kMessageOpcode = 0x05;       // https://mcap.dev/spec#message-op0x05
constexpr uint8_t kMessageIndexOpcode = 0x07;  // https://mcap.dev/spec#message-index-op0x07
constexpr uint64_t kRecordHeader = 1 + 8;
constexpr uint64_t kMessageFields = 2 + 4 + 8 + 8;  // what stands before the data of a message

// Sizes and places in MCAP have more bits, but no reader wants such a chunk in memory.
constexpr uint64_t kMaximumChunk = 0xffffffff;

// Records that are no messages become objects, of many times their size. Twice as many as there are ids of
// schemas and channels together.
constexpr uint64_t kMaximumOthers = 0x40000;

enum class RecordsReason : uint8_t {
  None,
  HeaderCut,
  ContentCut,
  Opcode,
  ShortMessage,
  NoRoute,
  TooLarge,
  ChunkTooLarge,
  TooManyOthers,
  OutOfMemory,
};

// What is wrong with a chunk, and where. Functions that can fail return false and fill it in.
struct RecordsError {
  RecordsReason reason = RecordsReason::None;
  uint64_t offset = 0;    // of the record
  uint64_t a = 0, b = 0;  // the numbers in the text of the reason

  bool stop(RecordsReason why, uint64_t where, uint64_t first = 0, uint64_t second = 0) {
    reason = why;
    offset = where;
    a = first;
    b = second;
    return false;
  }
};

// What is wrong, and what to do.
std::string reason(const RecordsError& error);

struct Record {
  uint64_t offset;  // in the chunk
  uint8_t opcode;
  Input content;
};

struct MessageRecord {
  uint64_t offset;  // of the record in the chunk
  uint16_t topic_id;
  uint32_t sequence;
  uint64_t log_time, publish_time;
  Input data;
};

// Calls `on_message(MessageRecord)` and `on_other(Record)` for each record, in their order, until one of them
// returns false.
template <class OnMessage, class OnOther>
ROSIDL_PROTO_INLINE bool walk_records(Input chunk, RecordsError& error, OnMessage on_message,
                                      OnOther on_other) {
  for (uint64_t at = 0; at < chunk.size;) {
    const uint64_t left = chunk.size - at;
    if (left < kRecordHeader) return error.stop(RecordsReason::HeaderCut, at, kRecordHeader, left);
    const uint8_t* const p = chunk.data + at;
    const auto size = load_little<uint64_t>(p + 1);
    if (p[0] == 0) return error.stop(RecordsReason::Opcode, at);
    if (size > left - kRecordHeader)
      return error.stop(RecordsReason::ContentCut, at, size, left - kRecordHeader);
    const uint8_t* const content = p + kRecordHeader;
    if (p[0] == kMessageOpcode) {
      if (size < kMessageFields) return error.stop(RecordsReason::ShortMessage, at, kMessageFields, size);
      const MessageRecord message = {at,
                                     load_little<uint16_t>(content),
                                     load_little<uint32_t>(content + 2),
                                     load_little<uint64_t>(content + 6),
                                     load_little<uint64_t>(content + 14),
                                     {content + kMessageFields, size - kMessageFields}};
      if (!on_message(message)) return false;
    } else if (!on_other(Record{at, p[0], {content, size}})) {
      return false;
    }
    at += kRecordHeader + size;
  }
  return true;
}

// Writes what stands before the data of a message; returns the place after it.
inline uint8_t* put_message_header(uint8_t* out, const MessageRecord& message, uint16_t topic_id,
                                   uint64_t size) {
  out[0] = kMessageOpcode;
  store_little(out + 1, kMessageFields + size);
  store_little(out + 9, topic_id);
  store_little(out + 11, message.sequence);
  store_little(out + 15, message.log_time);
  store_little(out + 23, message.publish_time);
  return out + kRecordHeader + kMessageFields;
}

// Which messages count by the time of their recording.
struct TimeRange {
  uint64_t start = 0;
  uint64_t end = 0;  // the first time that does not count
  bool endless = true;

  bool has(uint64_t time) const { return time >= start && (endless || time < end); }
};

// Something for each topic id: 16 bits, of which a chunk has a few that lie side by side.
template <class T>
class ByTopic {
 public:
  T& operator[](uint16_t id) {
    auto& page = pages_[id >> 8];
    if (!page) page = std::make_unique<Page>();
    return (*page)[id & 0xff];
  }
  const T* find(uint16_t id) const {
    const auto& page = pages_[id >> 8];
    return page ? &(*page)[id & 0xff] : nullptr;
  }

  // Calls `visit(id, value)` in the order of ids, perhaps also for some that were never asked for.
  template <class Visit>
  void each(Visit visit) {
    for (unsigned high = 0; high < pages_.size(); ++high) {
      for (unsigned low = 0; pages_[high] && low < kPage; ++low)
        visit(static_cast<uint16_t>(high << 8 | low), (*pages_[high])[low]);
    }
  }

 private:
  static constexpr unsigned kPage = 256;
  using Page = std::array<T, kPage>;
  std::array<std::unique_ptr<Page>, 0x10000 / kPage> pages_;
};

// The index of a chunk: one MessageIndex record for each topic, in the order of their ids.
struct RecordIndex {
  struct Topic {
    uint16_t id;
    uint64_t place;  // of its record in `data`
    uint64_t message_count;
  };

  std::vector<uint8_t> data;
  std::vector<Topic> topics;
  uint64_t start_time = 0, end_time = 0;  // of the messages; 0 if there are none
};

bool index_records(Input chunk, RecordIndex& index, RecordsError& error) noexcept;

}  // namespace rosidl_proto
