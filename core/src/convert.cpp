#include "rosidl_adapter_proto/convert.hpp"

#include <algorithm>
#include <exception>
#include <optional>

namespace rosidl_proto {
namespace {

// Measures messages and writes them, one after the other, or both in one step. What is kept between the two
// steps is used again.
class Steps {
 public:
  explicit Steps(const Plan* widest) {
    if (widest != nullptr) fields_.emplace(*widest);
  }

  bool measure(const Route& route, Input message, uint64_t* size, Error& error) {
    if (route.treatment == Treatment::ProtoToCdr)
      return measure_proto_to_cdr(*route.plan, message, route.size_limit, *fields_, size, error);
    lengths_.clear();
    if (route.treatment == Treatment::Ros1ToProto)
      return measure_ros1_to_proto(*route.plan, message, route.size_limit, lengths_, size, error);
    return measure_cdr_to_proto(*route.plan, message, route.size_limit, lengths_, size, error);
  }

  // Whether messages can be written that were not measured.
  static bool has_one(const Route& route) { return route.treatment != Treatment::ProtoToCdr; }

  static bool append(const Route& route, Input message, Output room, uint64_t* size, Error& error) {
    return route.treatment == Treatment::Ros1ToProto
               ? append_ros1_to_proto(*route.plan, message, room, size, error)
               : append_cdr_to_proto(*route.plan, message, room, size, error);
  }

  bool write(const Route& route, Input message, Output output, Error& error) {
    if (route.treatment == Treatment::ProtoToCdr)
      return write_proto_to_cdr(*route.plan, message, *fields_, output, error);
    if (route.treatment == Treatment::Ros1ToProto)
      return write_ros1_to_proto(*route.plan, message, lengths_, 0, output, error);
    return write_cdr_to_proto(*route.plan, message, lengths_, 0, output, error);
  }

 private:
  Lengths lengths_;
  std::optional<Fields> fields_;
};

class Conversion {
 public:
  Conversion(const Plan* widest, ConvertedChunk& result, RecordsError& error)
      : steps_(widest), result_(result), error_(error) {}

  // Both return false if the chunk cannot be converted at all.
  bool copy_message(const MessageRecord& message, uint16_t topic_id) {
    uint8_t* const out = begin(message, topic_id, message.data.size);
    if (out == nullptr) return false;
    copy(out, message.data.data, message.data.size);
    end(message.data.size);
    return true;
  }

  bool transcode(const MessageRecord& message, const Route& route, uint64_t index) {
    uint64_t size = 0;
    Error error;
    if (Steps::has_one(route) && append(message, route, &size)) return true;
    if (steps_.measure(route, message.data, &size, error)) {
      uint8_t* const out = begin(message, route.topic_id, size);
      if (out == nullptr) return false;
      if (steps_.write(route, message.data, {out, size}, error)) return end(size), true;
    }
    ++result_.failure_counts[message.topic_id];
    if (result_.failures.size() < kKeptFailures) result_.failures.push_back({index, message});
    return !route.copy_failed || copy_message(message, route.failed_topic_id);
  }

 private:
  // Writes a message to what room there is; false if that is not enough, or if something is wrong with the
  // message.
  bool append(const MessageRecord& message, const Route& route, uint64_t* size) {
    constexpr uint64_t kHeader = kRecordHeader + kMessageFields;
    Memory& data = result_.data;
    const uint64_t room = std::min(data.capacity(), kMaximumChunk) - data.size();
    if (room < kHeader) return false;
    uint8_t* const out = data.data() + data.size();
    const Output content = {out + kHeader, std::min(room - kHeader, route.size_limit)};
    Error error;
    if (!Steps::append(route, message.data, content, size, error)) return false;
    put_message_header(out, message, route.topic_id, *size);
    return end(*size), true;
  }

  // Makes room for a message and writes its header; it counts from `end` on.
  uint8_t* begin(const MessageRecord& message, uint16_t topic_id, uint64_t size) {
    const uint64_t whole = kRecordHeader + kMessageFields + size;
    if (whole > kMaximumChunk - result_.data.size()) {
      error_.stop(RecordsReason::TooLarge, message.offset, kMaximumChunk);
      return nullptr;
    }
    uint8_t* const out = result_.data.reserve(whole);
    if (out != nullptr) return put_message_header(out, message, topic_id, size);
    error_.stop(RecordsReason::OutOfMemory, message.offset);
    return nullptr;
  }

  void end(uint64_t size) {
    result_.data.add(kRecordHeader + kMessageFields + size);
    ++result_.message_count;
  }

  Steps steps_;
  ConvertedChunk& result_;
  RecordsError& error_;
};

}  // namespace

void RecordConverter::add(uint16_t topic_id, const Route& route) {
  routes_[topic_id] = route;
  if (route.treatment != Treatment::ProtoToCdr) return;
  if (widest_ == nullptr || route.plan->root().slots > widest_->root().slots) widest_ = route.plan;
}

bool RecordConverter::convert(Input chunk, const TimeRange& times, ConvertedChunk& result,
                              RecordsError& error) const noexcept {
  try {
    Conversion conversion(widest_, result, error);
    // Mostly it is enough, and what is not used of it is no memory yet.
    result.data.reserve(std::min(chunk.size + chunk.size / 4, kMaximumChunk));
    uint64_t index = 0;
    const auto convert_message = [&](const MessageRecord& message) {
      const uint64_t here = index++;
      const Route* const route = routes_.find(message.topic_id);
      const Treatment treatment = route == nullptr ? Treatment::NoRoute : route->treatment;
      if (treatment == Treatment::NoRoute)
        return error.stop(RecordsReason::NoRoute, message.offset, message.topic_id);
      if (treatment == Treatment::LeaveOut || !times.has(message.log_time)) return true;
      if (treatment == Treatment::Copy) return conversion.copy_message(message, route->topic_id);
      return conversion.transcode(message, *route, here);
    };
    return walk_records(chunk, error, convert_message, [](const Record&) { return true; });
  } catch (const std::exception&) {
    return error.stop(RecordsReason::OutOfMemory, 0);
  }
}

Error RecordConverter::error(const MessageRecord& message) const {
  const Route& way = route(message.topic_id);
  Error error;
  Steps steps(way.plan);
  uint64_t size = 0;
  if (!steps.measure(way, message.data, &size, error)) return error;
  std::vector<uint8_t> memory(static_cast<size_t>(size));
  if (steps.write(way, message.data, {memory.data(), size}, error)) error.reason = Reason::Changed;
  return error;
}

}  // namespace rosidl_proto
