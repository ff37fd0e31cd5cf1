// Chunks: walked through, indexed and converted.
#include "rosidl_adapter_proto/records.hpp"

#include "checks.hpp"
#include "rosidl_adapter_proto/convert.hpp"

namespace rosidl_proto::test {
namespace {

void add_record(Bytes& chunk, uint8_t opcode, const Bytes& content) {
  chunk.resize(chunk.size() + kRecordHeader);
  chunk[chunk.size() - kRecordHeader] = opcode;
  store_little(chunk.data() + chunk.size() - 8, uint64_t{content.size()});
  chunk.insert(chunk.end(), content.begin(), content.end());
}

void add_message(Bytes& chunk, uint16_t topic_id, uint64_t log_time, const Bytes& data) {
  const MessageRecord message = {0, topic_id, 7, log_time, 8, {data.data(), data.size()}};
  Bytes record(kRecordHeader + kMessageFields);
  put_message_header(record.data(), message, topic_id, data.size());
  chunk.insert(chunk.end(), record.begin(), record.end());
  chunk.insert(chunk.end(), data.begin(), data.end());
}

Input input_of(const Bytes& bytes) { return {bytes.data(), bytes.size()}; }

std::string text_of(const RecordsError& error) { return std::to_string(error.offset) + ": " + reason(error); }

std::string walk(const Bytes& chunk) {
  std::ostringstream text;
  RecordsError error;
  const bool good = walk_records(
      input_of(chunk), error,
      [&](const MessageRecord& message) {
        text << message.offset << " topic " << message.topic_id << " sequence " << message.sequence << " at "
             << message.log_time << " and " << message.publish_time << ", " << message.data.size
             << " bytes\n";
        return true;
      },
      [&](const Record& other) {
        text << other.offset << " opcode " << int{other.opcode} << ", " << other.content.size << " bytes\n";
        return true;
      });
  if (!good) text << text_of(error) << "\n";
  return text.str();
}

Bytes convert(const RecordConverter& converter, const Bytes& chunk, ConvertedChunk& result) {
  RecordsError error;
  if (!converter.convert(input_of(chunk), {}, result, error)) {
    const std::string text = text_of(error);
    return Bytes(text.begin(), text.end());
  }
  return Bytes(result.data.data(), result.data.data() + result.data.size());
}

TEST(chunks_are_walked_through) {
  Bytes chunk;
  CHECK_EQUAL(walk(chunk), "");
  add_message(chunk, 3, 5, {1, 2});
  add_record(chunk, 0x80, {1});
  add_message(chunk, 0xffff, ~uint64_t{0}, {});
  CHECK_EQUAL(walk(chunk),
              "0 topic 3 sequence 7 at 5 and 8, 2 bytes\n"
              "33 opcode 128, 1 bytes\n"
              "43 topic 65535 sequence 7 at 18446744073709551615 and 8, 0 bytes\n");
}

TEST(chunks_that_are_cut_off_are_errors) {
  Bytes chunk;
  add_message(chunk, 3, 5, {1, 2});
  for (size_t size = 1; size < chunk.size(); ++size) {
    // A copy of the exact size, for those who look for reads beyond it.
    const std::string text = walk(Bytes(chunk.begin(), chunk.begin() + static_cast<std::ptrdiff_t>(size)));
    CHECK_EQUAL(text, size < kRecordHeader ? "0: a record begins with 9 bytes and " + std::to_string(size) +
                                                 " are left; the chunk is cut off or damaged\n"
                                           : "0: a record of 24 bytes is announced and " +
                                                 std::to_string(size - kRecordHeader) +
                                                 " are left; the chunk is cut off or damaged\n");
  }
}

TEST(an_index_is_sorted_by_topic_and_time) {
  Bytes chunk;
  const uint64_t times[] = {5, 3, 5, 4};
  for (const uint64_t time : times) add_message(chunk, 300, time, {});
  add_message(chunk, 2, 9, {});
  RecordIndex index;
  RecordsError error;
  CHECK(index_records(input_of(chunk), index, error));
  CHECK_EQUAL(index.topics.size(), 2u);
  CHECK_EQUAL(index.topics[0].id, 2);
  CHECK_EQUAL(index.topics[1].place, kRecordHeader + 6 + 16);
  CHECK_EQUAL(index.topics[1].message_count, 4u);
  CHECK_EQUAL(index.start_time, 3u);
  CHECK_EQUAL(index.end_time, 9u);
  const uint64_t expected[] = {3, 31, 4, 93, 5, 0, 5, 62};
  const uint8_t* const entries = index.data.data() + index.topics[1].place + kRecordHeader + 6;
  for (size_t i = 0; i < 8; ++i) CHECK_EQUAL(load_little<uint64_t>(entries + 8 * i), expected[i]);
}

TEST(chunks_survive_both_directions) {
  const Plan plan = golden_plan("every_form"), image = golden_plan("image");
  Bytes chunk;
  for (uint32_t seed = 0; seed < 300; ++seed)
    add_message(chunk, seed % 2, seed, random_cdr(seed % 2 ? plan : image, seed));
  add_message(chunk, 2, 1, {1, 2, 3});
  RecordConverter there, back;
  there.add(1, {Treatment::CdrToProto, 11, &plan});
  there.add(0, {Treatment::CdrToProto, 10, &image});
  there.add(2, {Treatment::Copy, 12});
  back.add(11, {Treatment::ProtoToCdr, 1, &plan});
  back.add(10, {Treatment::ProtoToCdr, 0, &image});
  back.add(12, {Treatment::Copy, 2});
  ConvertedChunk first, second;
  CHECK(convert(back, convert(there, chunk, first), second) == chunk);
  CHECK_EQUAL(first.message_count, 301u);
  CHECK(first.failures.empty() && second.failures.empty());
}

TEST(messages_that_fail_are_told_and_kept) {
  const Plan plan = golden_plan("image");
  Bytes chunk, expected;
  const Bytes good = random_cdr(plan, 1), bad = {0, 1, 0, 0, 1, 0, 0, 0};
  std::string text;
  add_message(chunk, 1, 0, good);
  add_message(chunk, 1, 1, bad);
  add_message(chunk, 1, 2, good);
  add_message(expected, 1, 0, to_proto(plan, good, &text));
  add_message(expected, 9, 1, bad);
  add_message(expected, 1, 2, to_proto(plan, good, &text));
  RecordConverter converter;
  converter.add(1, {Treatment::CdrToProto, 1, &plan, kMaximumSize, true, 9});
  ConvertedChunk result;
  CHECK(convert(converter, chunk, result) == expected);
  CHECK_EQUAL(result.failure_counts[1], 1u);
  CHECK_EQUAL(result.failures.size(), 1u);
  CHECK_EQUAL(result.failures[0].index, 1u);
  const Error error = converter.error(result.failures[0].message);
  CHECK_EQUAL(field_path(error, plan), "header.stamp.nanosec");
  CHECK_EQUAL(reason(error), "4 bytes are needed and 0 are left; the data is cut off or of another type");
}

TEST(a_topic_without_a_route_is_an_error) {
  Bytes chunk;
  add_message(chunk, 1, 0, {});
  add_message(chunk, 2, 0, {});
  RecordConverter converter;
  converter.add(1, {Treatment::LeaveOut});
  ConvertedChunk result;
  const Bytes text = convert(converter, chunk, result);
  CHECK_EQUAL(
      std::string(text.begin(), text.end()),
      "31: there is no route for topic id 2; give one, or None to leave the messages of this topic out");
}

TEST(ros1_is_cdr_without_what_cdr_adds) {
  const Plan plan = golden_plan("image");
  // header.stamp, header.frame_id, width, data, step
  const Bytes ros1 = {1, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 'm', 3, 0, 0, 0, 1, 0, 0, 0, 9, 4, 0, 0, 0};
  const Bytes cdr = {0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 'm', 0,
                     0, 0, 3, 0, 0, 0, 1, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0,   0};
  std::string text;
  Error error;
  Lengths lengths;
  uint64_t size = 0;
  CHECK(measure_ros1_to_proto(plan, input_of(ros1), kMaximumSize, lengths, &size, error));
  Bytes proto(size);
  CHECK(write_ros1_to_proto(plan, input_of(ros1), lengths, 0, {proto.data(), size}, error));
  CHECK(proto == to_proto(plan, cdr, &text));
  CHECK_EQUAL(text, "");
}

}  // namespace
}  // namespace rosidl_proto::test
