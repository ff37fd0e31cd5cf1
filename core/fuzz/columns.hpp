// Columns under the fuzzer.
#pragma once

#include "../test/plain_layout.hpp"
#include "rosidl_adapter_proto/wire.hpp"

// Fills columns with a message; what is wrong goes to `check`.
template <class Check>
void fuzz_columns(const rosidl_proto::Plan& plan, rosidl_proto::Input message, Check check) {
  using namespace rosidl_proto;
  constexpr size_t kMany = 2000;
  constexpr uint64_t kLimit = 1 << 20;
  const std::vector<uint8_t> layout = plain_layout(plan, kMany);
  Columns columns(kLimit), other;
  // A message as layout: it may fit by chance.
  other.load(plan, message.data, static_cast<size_t>(message.size));
  if (layout.size() >= kMany) return;
  check(columns.load(plan, layout.data(), layout.size()) == nullptr, "a layout cannot be loaded");
  for (const Serialization each : {Serialization::Cdr, Serialization::Protobuf, Serialization::Ros1}) {
    for (int i = 0; i < 2; ++i) {
      const uint64_t rows = columns.rows(), bytes = columns.bytes();
      Error error;
      const bool good = columns.append(each, message, error);
      check(columns.rows() == rows + good, "a row is not counted");
      check(good || columns.bytes() == bytes, "a message that failed left something");
      check(good || error.reason != Reason::None, "columns have an error without a reason");
      check(good || error.offset <= message.size, "an error of columns lies outside of the input");
    }
  }
  const uint64_t rows = columns.rows();
  std::vector<Column> taken;
  check(columns.take(&taken), "columns cannot be taken");
  for (size_t i = 0; i < taken.size();) {
    check(taken[i].count == rows, "a column has another number of rows");
    for (const size_t end = i + taken[i].span; i < end; ++i) {
      const Column& each = taken[i];
      uint64_t values = each.count * each.length, before = 0;
      for (uint64_t row = 0; !each.fixed() && row <= each.count; ++row) {
        values = load_little<uint32_t>(each.offsets.data() + row * 4);
        check(values >= before, "offsets go back");
        before = values;
      }
      const uint64_t size = each.boolean ? (values + 7) / 8 : values * each.width;
      check(each.values.size() == size, "a column has another size than its offsets say");
      if (each.kind == ColumnKind::List) check(taken[i + 1].count == values, "a list has other elements");
    }
  }
}
