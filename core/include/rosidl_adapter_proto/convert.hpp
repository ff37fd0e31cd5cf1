// Chunks to chunks: each message goes the way of its topic, and is transcoded, copied or left out.
#pragma once

#include "records.hpp"

namespace rosidl_proto {

enum class Treatment : uint8_t { NoRoute, LeaveOut, Copy, CdrToProto, ProtoToCdr, Ros1ToProto };

// What becomes of the messages of one topic.
struct Route {
  Treatment treatment = Treatment::NoRoute;
  uint16_t topic_id = 0;  // in the result
  // What messages are transcoded along. The plan outlives the route.
  const Plan* plan = nullptr;
  uint64_t size_limit = kMaximumSize;
  // Messages that cannot be transcoded are left out, or copied to another topic.
  bool copy_failed = false;
  uint16_t failed_topic_id = 0;
};

// A message that could not be transcoded, in the chunk that it came in.
struct FailedMessage {
  uint64_t index;  // which message of the chunk
  MessageRecord message;
};

// Of how many messages of a chunk that fail it is told which they are: nobody reads more.
constexpr size_t kKeptFailures = 10;

struct ConvertedChunk {
  Memory data;
  uint64_t message_count = 0;
  ByTopic<uint64_t> failure_counts;     // of all that failed, by the topic id in the chunk that came in
  std::vector<FailedMessage> failures;  // the first of them
};

// It does not change while it converts: any number of threads may use it.
class RecordConverter {
 public:
  void add(uint16_t topic_id, const Route& route);
  const Route& route(uint16_t topic_id) const { return *routes_.find(topic_id); }

  // Records that are no messages are left out.
  bool convert(Input chunk, const TimeRange& times, ConvertedChunk& result,
               RecordsError& error) const noexcept;

  // What is wrong with a message that failed: found by doing it again, so that nothing need be kept of those
  // that nobody asks for.
  Error error(const MessageRecord& message) const;

 private:
  ByTopic<Route> routes_;
  const Plan* widest_ = nullptr;  // of all that are read from protobuf, the one with the most slots
};

}  // namespace rosidl_proto
