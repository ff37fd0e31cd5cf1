#include "rosidl_adapter_proto/records.hpp"

#include <algorithm>
#include <exception>

namespace rosidl_proto {
namespace {

constexpr uint64_t kIndexFields = 2 + 4;  // of a MessageIndex, before its entries

// When a message was recorded, and where in the chunk its record is.
struct Entry {
  uint64_t log_time, offset;
};

// What is known of one topic while a chunk is indexed.
struct Indexed {
  uint64_t message_count = 0;
  uint64_t last_time = 0;
  bool sorted = true;
  uint64_t next = 0;  // where in the entries of all topics the next one goes
};

struct Found {
  uint16_t topic_id;
  Entry entry;
};

// Puts the entries of each topic together, in the order of time and then of the chunk.
std::vector<Entry> sort_entries(const std::vector<Found>& found, ByTopic<Indexed>& topics) {
  std::vector<Entry> entries(found.size());
  uint64_t first = 0;
  topics.each([&](uint16_t, Indexed& topic) {
    topic.next = first;
    first += topic.message_count;
  });
  for (const Found& each : found) entries[topics[each.topic_id].next++] = each.entry;
  topics.each([&](uint16_t, Indexed& topic) {
    if (topic.sorted) return;
    const auto last = entries.begin() + static_cast<std::ptrdiff_t>(topic.next);
    std::stable_sort(last - static_cast<std::ptrdiff_t>(topic.message_count), last,
                     [](const Entry& a, const Entry& b) { return a.log_time < b.log_time; });
  });
  return entries;
}

void write_index(const std::vector<Entry>& entries, ByTopic<Indexed>& topics, RecordIndex& index) {
  topics.each([&](uint16_t id, const Indexed& topic) {
    if (topic.message_count == 0) return;
    const uint64_t place = index.data.size(), size = topic.message_count * sizeof(Entry);
    index.topics.push_back({id, place, topic.message_count});
    index.data.resize(place + kRecordHeader + kIndexFields + size);
    uint8_t* const out = index.data.data() + place;
    out[0] = kMessageIndexOpcode;
    store_little(out + 1, kIndexFields + size);
    store_little(out + 9, id);
    store_little(out + 11, static_cast<uint32_t>(size));
    copy(out + kRecordHeader + kIndexFields,
         reinterpret_cast<const uint8_t*>(entries.data() + topic.next - topic.message_count), size);
  });
}

}  // namespace

std::string reason(const RecordsError& error) {
  const std::string a = std::to_string(error.a), b = std::to_string(error.b);
  switch (error.reason) {
    case RecordsReason::None:
      return "nothing is wrong";
    case RecordsReason::HeaderCut:
      return "a record begins with " + a + " bytes and " + b + " are left; the chunk is cut off or damaged";
    case RecordsReason::ContentCut:
      return "a record of " + a + " bytes is announced and " + b +
             " are left; the chunk is cut off or damaged";
    case RecordsReason::Opcode:
      return "0 is no opcode of a record; the chunk is damaged";
    case RecordsReason::ShortMessage:
      return "a message record has at least " + a + " bytes and this one has " + b + "; the chunk is damaged";
    case RecordsReason::NoRoute:
      return "there is no route for topic id " + a +
             "; give one, or None to leave the messages of this topic out";
    case RecordsReason::TooLarge:
      return "with this message the result would have more than " + a + " bytes; make smaller chunks";
    case RecordsReason::ChunkTooLarge:
      return "the chunk has " + a + " bytes and may have " + b + "; make smaller chunks";
    case RecordsReason::TooManyOthers:
      return "the chunk has more than " + a + " records that are no messages; it is damaged";
    case RecordsReason::OutOfMemory:
      return "there is not enough memory for the result; make smaller chunks";
  }
  return "";
}

bool index_records(Input chunk, RecordIndex& index, RecordsError& error) noexcept {
  try {
    ByTopic<Indexed> topics;
    std::vector<Found> found;
    uint64_t start = UINT64_MAX, end = 0;
    const auto add = [&](const MessageRecord& message) {
      Indexed& topic = topics[message.topic_id];
      topic.sorted &= message.log_time >= topic.last_time;
      topic.last_time = message.log_time;
      ++topic.message_count;
      start = std::min(start, message.log_time);
      end = std::max(end, message.log_time);
      found.push_back({message.topic_id, {message.log_time, message.offset}});
      return true;
    };
    if (chunk.size > kMaximumChunk)
      return error.stop(RecordsReason::ChunkTooLarge, 0, chunk.size, kMaximumChunk);
    if (!walk_records(chunk, error, add, [](const Record&) { return true; })) return false;
    if (!found.empty()) index.start_time = start, index.end_time = end;
    write_index(sort_entries(found, topics), topics, index);
    return true;
  } catch (const std::exception&) {
    return error.stop(RecordsReason::OutOfMemory, 0);
  }
}

}  // namespace rosidl_proto
