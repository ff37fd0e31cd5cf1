// Both directions from C++: results, errors, and what Python cannot show.
#include "rosidl_adapter_proto/transcode.hpp"

#include <limits>

#include "checks.hpp"
#include "rosidl_adapter_proto/packed_fields.hpp"
#include "text.hpp"

namespace rosidl_proto::test {

namespace {

Bytes failed(const Plan& plan, const Error& error, std::string* text) {
  *text = field_path(error, plan) + " at " + std::to_string(error.offset) + ": " + reason(error);
  return {};
}

}  // namespace

Bytes to_proto(const Plan& plan, const Bytes& cdr, std::string* text) {
  Error error;
  Lengths lengths;
  uint64_t size = 0;
  const Input input{cdr.data(), cdr.size()};
  if (!measure_cdr_to_proto(plan, input, kMaximumSize, lengths, &size, error))
    return failed(plan, error, text);
  Bytes proto(size);
  if (!write_cdr_to_proto(plan, input, lengths, 0, {proto.data(), size}, error))
    return failed(plan, error, text);
  return proto;
}

Bytes to_cdr(const Plan& plan, const Bytes& proto, std::string* text) {
  Error error;
  Fields fields(plan);
  uint64_t size = 0;
  const Input input{proto.data(), proto.size()};
  if (!measure_proto_to_cdr(plan, input, kMaximumSize, fields, &size, error))
    return failed(plan, error, text);
  Bytes cdr(size);
  if (!write_proto_to_cdr(plan, input, fields, {cdr.data(), size}, error)) return failed(plan, error, text);
  return cdr;
}

namespace {

TEST(random_messages_survive_both_directions) {
  for (const char* name : {"every_form", "image", "general"}) {
    const Plan plan = golden_plan(name);
    for (uint32_t seed = 0; seed < 200; ++seed) {
      std::string error;
      const Bytes cdr = random_cdr(plan, seed);
      CHECK(to_cdr(plan, to_proto(plan, cdr, &error), &error) == cdr);
      CHECK_EQUAL(error, "");
    }
  }
}

TEST(a_message_that_is_cut_off_is_an_error) {
  const Plan plan = golden_plan("every_form");
  const Bytes cdr = random_cdr(plan, 1);
  for (size_t size = 0; size < cdr.size(); ++size) {
    std::string error;
    to_proto(plan, Bytes(cdr.begin(), cdr.begin() + static_cast<std::ptrdiff_t>(size)), &error);
    CHECK(!error.empty());
  }
}

TEST(chosen_fields_are_all_that_is_read) {
  const Plan whole = golden_plan("image"), plan = golden_plan("chosen_fields");
  // header.stamp, header.frame_id, width, data, step
  const Bytes cdr = {0, 1, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 'm', 0,
                     0, 0, 3, 0, 0, 0, 1, 0, 0, 0, 9, 0, 0, 0, 4, 0, 0,   0};
  const Bytes proto = {0x0a, 7, 0x0a, 5, 0x15, 2, 0, 0, 0, 0x15, 3, 0, 0, 0};
  std::string error;
  CHECK(to_proto(plan, cdr, &error) == proto);
  CHECK(to_proto(plan, Bytes(cdr.begin(), cdr.begin() + 24), &error) == proto);
  CHECK_EQUAL(error, "");
  CHECK(!to_proto(whole, cdr, &error).empty());
  CHECK_EQUAL(error, "");
  to_cdr(plan, proto, &error);
  CHECK_EQUAL(error,
              " at 0: only chosen fields are transcoded, and a ROS message needs all of them; use a "
              "transcoder without fields");
}

TEST(errors_say_what_and_where) {
  const Plan plan = golden_plan("image");
  std::string error;
  to_proto(plan, {0, 1, 0, 0, 1, 0, 0, 0}, &error);
  CHECK_EQUAL(error,
              "header.stamp.nanosec at 8: 4 bytes are needed and 0 are left; the data is cut off or of "
              "another type");
}

TEST(numbers_in_errors_are_short_and_exact) {
  CHECK_EQUAL(number_text(std::numeric_limits<int64_t>::min()), "-9223372036854775808");
  CHECK_EQUAL(number_text(65520.0), "65520");
  CHECK_EQUAL(number_text(-0.5), "-0.5");
  CHECK_EQUAL(number_text(double{std::numeric_limits<float>::max()}), "3.40282347e+38");
}

TEST(groups_are_skipped) {
  const Plan plan = golden_plan("image");
  const Bytes cdr = random_cdr(plan, 3);
  std::string error;
  const Bytes proto = to_proto(plan, cdr, &error);
  // Field 1 is a group with a number, text and another group in it.
  const Bytes group = {0x0b, 0x10, 5, 0x1a, 2, 'a', 'b', 0x0b, 0x0c, 0x25, 1, 2, 3, 4, 0x0c};
  Bytes with_groups = group;
  with_groups.insert(with_groups.end(), proto.begin(), proto.end());
  with_groups.insert(with_groups.end(), group.begin(), group.end());
  CHECK(to_cdr(plan, with_groups, &error) == cdr);
  CHECK_EQUAL(error, "");
  for (size_t size = 1; size < group.size(); ++size) {
    error.clear();
    to_cdr(plan, Bytes(group.begin(), group.begin() + static_cast<std::ptrdiff_t>(size)), &error);
    CHECK_EQUAL(error,
                " at 1: the group of field number 1 has no end, no beginning or too many groups inside; the "
                "data is damaged or no protobuf message");
  }
}

TEST(packed_fields_are_found_between_groups) {
  // Field 2 beside groups, one of which has a field 2 inside.
  const Bytes proto = {0x0b, 0x12, 1, 7, 0x0c, 0x12, 2, 8, 9, 0x13, 0x14};
  const uint64_t number = 2;
  Slice slice, other;
  CHECK(find_packed_fields(proto.data(), proto.data() + proto.size(), &number, 1, &slice));
  CHECK(Bytes(slice.data, slice.data + slice.size) == (Bytes{8, 9}));
  CHECK(!find_packed_fields(proto.data(), proto.data() + proto.size() - 1, &number, 1, &other));
}

TEST(one_step_makes_the_same_where_there_is_room) {
  for (const char* name : {"every_form", "image"}) {
    const Plan plan = golden_plan(name);
    const Bytes cdr = random_cdr(plan, 7);
    const Input input{cdr.data(), cdr.size()};
    std::string text;
    const Bytes proto = to_proto(plan, cdr, &text);
    for (size_t room = 0; room <= proto.size() + 8; ++room) {
      Bytes memory(room + 1, 0xee);
      Error error;
      uint64_t size = 0;
      const bool fits = append_cdr_to_proto(plan, input, {memory.data(), room}, &size, error);
      CHECK_EQUAL(fits, room >= proto.size());
      CHECK(fits ? size == proto.size() : error.reason == Reason::NoRoom);
      CHECK(!fits || std::equal(proto.begin(), proto.end(), memory.begin()));
      CHECK_EQUAL(memory[room], 0xee);
    }
  }
}

TEST(an_empty_result_needs_no_memory) {
  const Plan plan = golden_plan("image");  // in which empty messages are left out
  Error error;
  Lengths lengths;
  uint64_t size = 1;
  Bytes zeros(4 + 24, 0);
  zeros[1] = 1;
  const Input input{zeros.data(), zeros.size()};
  CHECK(measure_cdr_to_proto(plan, input, kMaximumSize, lengths, &size, error));
  CHECK_EQUAL(size, 0u);
  CHECK(write_cdr_to_proto(plan, input, lengths, 0, {nullptr, 0}, error));
}

}  // namespace
}  // namespace rosidl_proto::test
