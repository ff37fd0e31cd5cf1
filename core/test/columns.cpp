#include "rosidl_adapter_proto/columns.hpp"

#include "checks.hpp"
#include "plain_layout.hpp"

namespace rosidl_proto::test {
namespace {

constexpr size_t kMany = 10000;

Columns columns_of(const Plan& plan, uint64_t limit = kMaximumColumn) {
  Columns columns(limit);
  const std::vector<uint8_t> layout = plain_layout(plan, kMany);
  CHECK(columns.load(plan, layout.data(), layout.size()) == nullptr);
  return columns;
}

bool append(Columns& columns, Serialization serialization, const Bytes& message) {
  Error error;
  return columns.append(serialization, {message.data(), message.size()}, error);
}

Bytes bytes_of(const Memory& memory) { return Bytes(memory.data(), memory.data() + memory.size()); }

// Every number, offset and text, so that different columns are different texts.
std::string text_of(Columns& columns) {
  std::vector<Column> taken;
  CHECK(columns.take(&taken));
  std::string text;
  for (const Column& each : taken) {
    text += std::to_string(each.count) + ":";
    for (const Memory* memory : {&each.offsets, &each.values}) {
      for (const uint8_t byte : bytes_of(*memory)) text += std::to_string(byte) + " ";
      text += "|";
    }
  }
  return text;
}

TEST(columns_get_the_same_from_both_readers) {
  for (const char* name : {"every_form", "image", "general"}) {
    const Plan plan = golden_plan(name);
    Columns from_cdr = columns_of(plan), from_proto = columns_of(plan);
    for (uint32_t batch = 0; batch < 3; ++batch) {
      for (uint32_t seed = 0; seed < 20; ++seed) {
        std::string error;
        const Bytes cdr = random_cdr(plan, batch * 20 + seed);
        const Bytes proto = to_proto(plan, cdr, &error);
        // Wide strings that are no text fail in both.
        CHECK_EQUAL(append(from_cdr, Serialization::Cdr, cdr),
                    append(from_proto, Serialization::Protobuf, proto));
      }
      CHECK(from_cdr.rows() != 0);
      CHECK_EQUAL(from_cdr.rows(), from_proto.rows());
      CHECK_EQUAL(from_cdr.bytes(), from_proto.bytes());
      CHECK_EQUAL(text_of(from_cdr), text_of(from_proto));
    }
  }
}

TEST(a_message_that_fails_leaves_no_trace) {
  const Plan plan = golden_plan("every_form");
  Columns columns = columns_of(plan), plain = columns_of(plan);
  for (uint32_t seed = 0; seed < 5; ++seed) {
    const Bytes cdr = random_cdr(plan, seed);
    for (size_t size = 0; size < cdr.size(); ++size)
      CHECK(!append(columns, Serialization::Cdr, Bytes(cdr.begin(), cdr.begin() + static_cast<long>(size))));
    CHECK_EQUAL(append(columns, Serialization::Cdr, cdr), append(plain, Serialization::Cdr, cdr));
  }
  CHECK_EQUAL(text_of(columns), text_of(plain));
}

TEST(columns_of_a_message) {
  const Bytes cdr = {0, 1, 0, 0, 0xff, 0xff, 0xff, 0xff, 2, 0, 0, 0, 2, 0, 0, 0, 'm', 0,
                     0, 0, 3, 0, 0,    0,    2,    0,    0, 0, 9, 8, 0, 0, 4, 0, 0,   0};
  const Plan plan = golden_plan("image");
  Columns columns = columns_of(plan);
  CHECK(append(columns, Serialization::Cdr, cdr));
  CHECK(append(columns, Serialization::Cdr, cdr));
  CHECK_EQUAL(text_of(columns),
              "2:||2:||"                              // header, header.stamp
              "2:|255 255 255 255 255 255 255 255 |"  // header.stamp.sec
              "2:|2 0 0 0 2 0 0 0 |"                  // header.stamp.nanosec
              "2:0 0 0 0 1 0 0 0 2 0 0 0 |109 109 |"  // header.frame_id
              "2:|3 0 0 0 3 0 0 0 |"                  // width
              "2:0 0 0 0 2 0 0 0 4 0 0 0 |9 8 9 8 |"  // data
              "2:|4 0 0 0 4 0 0 0 |");                // step
  CHECK_EQUAL(columns.rows(), 0u);
}

TEST(columns_do_not_grow_beyond_their_limit) {
  const Plan plan = golden_plan("image");
  Columns columns = columns_of(plan, 256);
  const Bytes cdr = random_cdr(plan, 1);
  Error error;
  while (columns.append(Serialization::Cdr, {cdr.data(), cdr.size()}, error)) CHECK(columns.rows() < 256);
  CHECK(error.reason == Reason::ColumnsFull);
  const uint64_t rows = columns.rows();
  CHECK(rows > 1);
  CHECK(columns.bytes() <= 512);
  text_of(columns);
  CHECK(append(columns, Serialization::Cdr, cdr));
}

TEST(layouts_that_do_not_fit_are_refused) {
  const Plan plan = golden_plan("every_form");
  const std::vector<uint8_t> layout = plain_layout(plan, kMany);
  for (size_t i = 0; i < layout.size(); ++i) {
    for (uint8_t kind = 0; kind < 8; ++kind) {
      std::vector<uint8_t> other = layout;
      other[i] = kind;
      Columns columns;
      CHECK_EQUAL(columns.load(plan, other.data(), other.size()) == nullptr, kind == layout[i]);
    }
    Columns columns;
    CHECK(columns.load(plan, layout.data(), i) != nullptr);
  }
}

}  // namespace
}  // namespace rosidl_proto::test
