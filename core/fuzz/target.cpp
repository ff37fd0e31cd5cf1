// The fuzz target: all directions, columns and pairs, plans themselves, chunks of messages, and schemas.
//
// The first byte of an input says what to do with the rest:
//   0  the number of a plan, and then a CDR message; 1  the same with a protobuf message
//   2  a packed plan, its size before it as uint32, and then a CDR message; 3  the same with a protobuf
//   message
//   4  the number of a plan, and then a message of ROS 1
//   5  a chunk, in which each topic id is the number of a plan and a way to treat its messages
//   6  the text of the type test/msg/Root
//   7  a FileDescriptorSet of `test.General`
// The plans with numbers are in the file that the environment variable ROSIDL_PROTO_FUZZ_PLANS names, each
// with its size before it. make_corpus.py writes that file and inputs to begin with.
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <vector>

#include "columns.hpp"
#include "flat.hpp"
#include "rosidl_adapter_proto/convert.hpp"
#include "rosidl_adapter_proto/packed_fields.hpp"
#include "rosidl_adapter_proto/schema.hpp"
#include "rosidl_adapter_proto/transcode.hpp"
#include "rosidl_adapter_proto/wire.hpp"

using namespace rosidl_proto;

namespace {

constexpr uint64_t kLimit = 1 << 20;

// Exact sizes on the heap let the address sanitizer see every read and write beyond them.
struct Heap {
  explicit Heap(uint64_t bytes) : data(new uint8_t[bytes]), size(bytes) {}
  std::unique_ptr<uint8_t[]> data;
  uint64_t size;
};

void check(bool good, const char* what) {
  if (good) return;
  std::fprintf(stderr, "fuzz target: %s\n", what);
  std::abort();
}

void check_error(const Plan& plan, const Error& error, uint64_t size) {
  check(error.reason != Reason::None, "an error has no reason");
  check(error.reason != Reason::Changed, "the two steps do not agree");
  check(error.offset <= size, "an error lies outside of the input");
  check(!reason(error).empty(), "a reason has no text");
  field_path(error, plan);
}

using Append = bool(const Plan&, Input, Output, uint64_t*, Error&) noexcept;

// While a message is made in one step it takes tags and lengths of submessages that are left out in the end.
constexpr uint64_t kMore = 6 * uint64_t{kMaximumDepth};

// One step makes what two steps make where there is room, and fails where they fail.
void check_one_step(const Plan& plan, Input message, Append* append, const Heap* proto) {
  for (const uint64_t more : {uint64_t{0}, kMore}) {
    Heap room((proto == nullptr ? message.size : proto->size) + more);
    Error error;
    uint64_t size = 0;
    if (!append(plan, message, {room.data.get(), room.size}, &size, error)) {
      check_error(plan, error, message.size);
      check(proto == nullptr || (more == 0 && error.reason == Reason::NoRoom),
            "one step fails where two do not");
    } else {
      check(proto != nullptr && size == proto->size &&
                std::memcmp(room.data.get(), proto->data.get(), size) == 0,
            "one step and two make different messages");
    }
  }
}

std::unique_ptr<Heap> to_proto(const Plan& plan, Input cdr) {
  Error error;
  Lengths lengths;
  uint64_t size = 0;
  if (!measure_cdr_to_proto(plan, cdr, kLimit, lengths, &size, error)) {
    check_error(plan, error, cdr.size);
    return check_one_step(plan, cdr, append_cdr_to_proto, nullptr), nullptr;
  }
  check(size <= kLimit, "a result passes the limit");
  check(lengths.size() <= cdr.size, "there are more lengths than bytes");
  auto proto = std::make_unique<Heap>(size);
  check(write_cdr_to_proto(plan, cdr, lengths, 0, {proto->data.get(), size}, error),
        "measured CDR cannot be written");
  check_one_step(plan, cdr, append_cdr_to_proto, proto.get());
  return proto;
}

std::unique_ptr<Heap> to_cdr(const Plan& plan, Input proto) {
  Error error;
  Fields fields(plan);
  uint64_t size = 0;
  if (!measure_proto_to_cdr(plan, proto, kLimit, fields, &size, error))
    return check_error(plan, error, proto.size), nullptr;
  check(size <= kLimit, "a result passes the limit");
  auto cdr = std::make_unique<Heap>(size);
  if (!write_proto_to_cdr(plan, proto, fields, {cdr->data.get(), size}, error))
    return check_error(plan, error, proto.size), nullptr;
  return cdr;
}

std::unique_ptr<Heap> ros1_to_proto(const Plan& plan, Input ros1) {
  Error error;
  Lengths lengths;
  uint64_t size = 0;
  if (!measure_ros1_to_proto(plan, ros1, kLimit, lengths, &size, error)) {
    check_error(plan, error, ros1.size);
    return check_one_step(plan, ros1, append_ros1_to_proto, nullptr), nullptr;
  }
  check(size <= kLimit, "a result passes the limit");
  auto proto = std::make_unique<Heap>(size);
  check(write_ros1_to_proto(plan, ros1, lengths, 0, {proto->data.get(), size}, error),
        "measured ROS 1 cannot be written");
  check_one_step(plan, ros1, append_ros1_to_proto, proto.get());
  return proto;
}

Input input_of(const std::unique_ptr<Heap>& heap) { return {heap->data.get(), heap->size}; }

bool equal(const std::unique_ptr<Heap>& a, const std::unique_ptr<Heap>& b) {
  return a && b && a->size == b->size &&
         (a->size == 0 || std::memcmp(a->data.get(), b->data.get(), a->size) == 0);
}

// A plan that leaves fields out only reads CDR.
void check_refused(const Plan& plan, Input proto) {
  Error error;
  Fields fields(plan);
  uint64_t size = 0;
  check(!measure_proto_to_cdr(plan, proto, kLimit, fields, &size, error) && error.reason == Reason::Partial,
        "a partial plan writes CDR");
}

// What was written must be readable, and must give the same again. One thing is read from CDR and not from
// protobuf: strings with NUL inside.
void round_trip(const Plan& plan, bool is_cdr, Input input) {
  const auto proto = is_cdr ? to_proto(plan, input) : nullptr;
  if (is_cdr && !proto) return;
  if (plan.partial()) return check_refused(plan, input);
  const auto cdr = to_cdr(plan, is_cdr ? input_of(proto) : input);
  if (!cdr) return;
  const auto again = to_proto(plan, input_of(cdr));
  if (is_cdr) check(equal(proto, again), "CDR does not survive the round trip");
  if (!again) return;  // Past the limit, which protobuf can be and CDR not
  check(equal(cdr, to_cdr(plan, input_of(again))), "protobuf does not survive the round trip");
}

// The input may change between measuring and writing: whatever comes out, memory stays in order.
void change(const Plan& plan, Input cdr) {
  Error error;
  Lengths lengths;
  uint64_t size = 0;
  if (!measure_cdr_to_proto(plan, cdr, kLimit, lengths, &size, error)) return;
  Heap proto(size), changed(cdr.size);
  for (uint64_t step = 1; step < cdr.size; step = step * 3 + 1) {
    copy(changed.data.get(), cdr.data, cdr.size);
    for (uint64_t i = 4; i < cdr.size; i += step) changed.data[i] ^= static_cast<uint8_t>(step);
    write_cdr_to_proto(plan, {changed.data.get(), changed.size}, lengths, 0, {proto.data.get(), size}, error);
    error = Error();
  }
}

void change_proto(const Plan& plan, Input proto) {
  Error error;
  Fields fields(plan);
  uint64_t size = 0;
  if (!measure_proto_to_cdr(plan, proto, kLimit, fields, &size, error)) return;
  Heap cdr(size), changed(proto.size);
  for (uint64_t step = 1; step < proto.size; step = step * 3 + 1) {
    copy(changed.data.get(), proto.data, proto.size);
    // An index of what stood there before.
    uint64_t same = 0;
    check(measure_proto_to_cdr(plan, {changed.data.get(), changed.size}, kLimit, fields, &same, error) &&
              same == size,
          "one message has two sizes");
    for (uint64_t i = 0; i < proto.size; i += step) changed.data[i] ^= static_cast<uint8_t>(step);
    write_proto_to_cdr(plan, {changed.data.get(), changed.size}, fields, {cdr.data.get(), size}, error);
    error = Error();
  }
}

std::vector<Plan> read_plans() {
  const char* name = std::getenv("ROSIDL_PROTO_FUZZ_PLANS");
  std::FILE* file = name ? std::fopen(name, "rb") : nullptr;
  check(file != nullptr, "ROSIDL_PROTO_FUZZ_PLANS does not name the file that make_corpus.py wrote");
  std::vector<Plan> plans;
  uint8_t size_bytes[4];
  while (std::fread(size_bytes, 1, sizeof size_bytes, file) == sizeof size_bytes) {
    std::vector<uint8_t> bytes(load_little<uint32_t>(size_bytes));
    const bool whole = std::fread(bytes.data(), 1, bytes.size(), file) == bytes.size();
    check(whole && plans.emplace_back().load(bytes.data(), bytes.size()) == nullptr,
          "a plan in ROSIDL_PROTO_FUZZ_PLANS cannot be loaded");
  }
  std::fclose(file);
  check(!plans.empty(), "there are no plans in ROSIDL_PROTO_FUZZ_PLANS");
  return plans;
}

void run(const Plan& plan, bool is_cdr, Input message) {
  round_trip(plan, is_cdr, message);
  is_cdr ? change(plan, message) : change_proto(plan, message);
  fuzz_columns(plan, message, check);
  fuzz_flat(plan, message, check);
  const uint64_t number = 1;
  Slice slice;
  const uint8_t* const end = message.data + message.size;
  if (find_packed_fields(message.data, end, &number, 1, &slice))
    check(slice.size <= message.size, "a field is larger than its message");
}

void run_ros1(const Plan& plan, Input ros1) {
  const auto proto = ros1_to_proto(plan, ros1);
  if (!proto || plan.partial()) return;
  const auto cdr = to_cdr(plan, input_of(proto));
  if (cdr) check(equal(proto, to_proto(plan, input_of(cdr))), "ROS 1 and CDR do not agree");
}

// Chunks
// ----------------------------------------------------------------------------------------------------------

constexpr Treatment kTreatments[] = {Treatment::Copy, Treatment::CdrToProto, Treatment::ProtoToCdr,
                                     Treatment::Ros1ToProto};
constexpr size_t kWays = sizeof kTreatments / sizeof *kTreatments;
constexpr uint16_t kFailedTopic = 0xffff;

// What becomes of a topic: its id is `4 * plan + way`, and those from 0x8000 on are left out.
std::unique_ptr<RecordConverter> make_converter(const std::vector<Plan>& plans) {
  auto converter = std::make_unique<RecordConverter>();
  for (size_t i = 0; i < plans.size() * kWays; ++i) {
    const auto id = static_cast<uint16_t>(i);
    converter->add(id, {kTreatments[i % kWays], id, &plans[i / kWays], kLimit, i % 3 == 0, kFailedTopic});
  }
  for (uint32_t id = 0x8000; id < kFailedTopic; ++id)
    converter->add(static_cast<uint16_t>(id), {Treatment::LeaveOut});
  return converter;
}

void check_records_error(const RecordsError& error, Input chunk) {
  check(error.reason != RecordsReason::None && error.offset <= chunk.size, "an error of a chunk is nowhere");
  check(!reason(error).empty(), "a reason has no text");
}

std::vector<MessageRecord> messages_of(Input chunk) {
  std::vector<MessageRecord> messages;
  RecordsError error;
  const auto add = [&](const MessageRecord& each) { return messages.push_back(each), true; };
  if (!walk_records(chunk, error, add, [](const Record&) { return true; })) messages.clear();
  return messages;
}

void check_index(Input chunk, const std::vector<MessageRecord>& messages) {
  RecordIndex index;
  RecordsError error;
  if (!index_records(chunk, index, error)) return check_records_error(error, chunk);
  uint64_t count = 0;
  for (const RecordIndex::Topic& topic : index.topics) {
    const uint8_t* const record = index.data.data() + topic.place;
    uint64_t time = 0;
    for (uint64_t i = 0; i < topic.message_count; ++i) {
      const uint8_t* const entry = record + kRecordHeader + 6 + 16 * i;
      const auto offset = load_little<uint64_t>(entry + 8);
      check(load_little<uint64_t>(entry) >= time, "an index is not sorted");
      time = load_little<uint64_t>(entry);
      check(chunk.data[offset] == kMessageOpcode, "an index leads to what is no message");
      check(load_little<uint64_t>(chunk.data + offset + kRecordHeader + 6) == time,
            "an index has another time than the message");
      check(load_little<uint16_t>(chunk.data + offset + kRecordHeader) == topic.id,
            "an index has another topic than the message");
    }
    count += topic.message_count;
  }
  check(count == messages.size(), "an index does not have all messages");
}

std::unique_ptr<Heap> treat(const std::vector<Plan>& plans, const MessageRecord& message) {
  const Plan& plan = plans[message.topic_id / kWays];
  switch (kTreatments[message.topic_id % kWays]) {
    case Treatment::CdrToProto:
      return to_proto(plan, message.data);
    case Treatment::ProtoToCdr:
      return to_cdr(plan, message.data);
    case Treatment::Ros1ToProto:
      return ros1_to_proto(plan, message.data);
    default:
      break;
  }
  auto same = std::make_unique<Heap>(message.data.size);
  copy(same->data.get(), message.data.data, message.data.size);
  return same;
}

// The result is what single messages become.
void run_chunk(const std::vector<Plan>& plans, Input chunk) {
  static const std::unique_ptr<RecordConverter> converter = make_converter(plans);
  const std::vector<MessageRecord> messages = messages_of(chunk);
  check_index(chunk, messages);
  ConvertedChunk result;
  RecordsError error;
  if (!converter->convert(chunk, {}, result, error)) return check_records_error(error, chunk);
  const std::vector<MessageRecord> found = messages_of({result.data.data(), result.data.size()});
  check(found.size() == result.message_count, "a result cannot be read again");
  size_t place = 0, failed = 0;
  ByTopic<uint64_t> failure_counts;
  for (size_t i = 0; i < messages.size(); ++i) {
    const MessageRecord& message = messages[i];
    if (message.topic_id >= 0x8000) continue;
    const auto expected = treat(plans, message);
    Input content = message.data;
    if (expected) {
      content = input_of(expected);
    } else {
      check(
          failed >= kKeptFailures || (failed < result.failures.size() && result.failures[failed].index == i),
          "a failure is not told");
      ++failed;
      ++failure_counts[message.topic_id];
      check_error(plans[message.topic_id / kWays], converter->error(message), message.data.size);
      if (!converter->route(message.topic_id).copy_failed) continue;
    }
    check(place < found.size(), "a message is missing");
    const MessageRecord& converted = found[place++];
    check(converted.topic_id == (expected ? message.topic_id : kFailedTopic) &&
              converted.log_time == message.log_time && converted.publish_time == message.publish_time &&
              converted.sequence == message.sequence && converted.data.size == content.size &&
              (content.size == 0 || std::memcmp(converted.data.data, content.data, content.size) == 0),
          "a message is not what it becomes alone");
  }
  check(place == found.size(), "there are too many messages");
  check(result.failures.size() == std::min(failed, kKeptFailures), "there are too many failures");
  result.failure_counts.each([&](uint16_t topic_id, uint64_t count) {
    check(count == failure_counts[topic_id], "failures are not counted");
    failed -= count;
  });
  check(failed == 0, "failures are not counted");
}

// Schemas
// ----------------------------------------------------------------------------------------------------------

// What is read of a schema is a plan, though its messages may be too large for one.
void run_text(Input text) {
  std::vector<uint8_t> packed;
  const std::string_view view(reinterpret_cast<const char*>(text.data), text.size);
  const char* wrong = read_ros2msg(view, "test/msg/Root", &packed);
  check((wrong != nullptr) == packed.empty(), "a text is neither read nor refused");
  Plan plan;
  if (wrong != nullptr || (wrong = plan.load(packed.data(), packed.size())) == nullptr) return;
  check(std::string_view(wrong) == "a message of this type is larger than 2 GiB", wrong);
}

void run_descriptor_set(const uint8_t* data, size_t size) {
  check(file_descriptor_set_size(data, size) <= size, "a descriptor set is larger than its memory");
  std::vector<uint8_t> packed;
  FlatNotes notes;
  if (read_file_descriptor_set(data, size, "test.General", &packed, &notes) != nullptr) return;
  Plan plan;
  // What the reader leaves to this: names that are no UTF-8, field numbers that are there twice.
  if (plan.load(packed.data(), packed.size()) != nullptr) return;
  size_t operations = 0;
  for (uint32_t i = 0; i < plan.message_count(); ++i) operations += plan.message(i).count;
  check(notes.empty() || notes.size() == operations, "a field has no note");
  run(plan, false, {data, size});
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const std::vector<Plan> plans = read_plans();
  if (size < 2) return 0;
  const uint8_t mode = data[0];
  if (mode < 2) {
    run(plans[data[1] % plans.size()], mode == 0, {data + 2, size - 2});
  } else if (mode < 4 && size >= 5) {
    const uint32_t plan_size = load_little<uint32_t>(data + 1);
    Plan plan;
    if (plan_size > size - 5 || plan.load(data + 5, plan_size) != nullptr) return 0;
    run(plan, mode == 2, {data + 5 + plan_size, size - 5 - plan_size});
  } else if (mode == 4) {
    run_ros1(plans[data[1] % plans.size()], {data + 2, size - 2});
  } else if (mode == 5) {
    run_chunk(plans, {data + 1, size - 1});
  } else if (mode == 6) {
    run_text({data + 1, size - 1});
  } else if (mode == 7) {
    run_descriptor_set(data + 1, size - 1);
  }
  return 0;
}
