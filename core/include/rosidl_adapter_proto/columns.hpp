// Messages as columns: what every field of many messages holds, in memory as Arrow lays it out
// (https://arrow.apache.org/docs/format/Columnar.html).
//
// A layout says which columns there are, in the order of the fields and each before those inside of it: one
// byte for each, a `ColumnKind`. It is checked against the plan when it is loaded. Nothing is null, so there
// are no validity bitmaps; offsets have 32 bits.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "error.hpp"
#include "memory.hpp"
#include "plan.hpp"
#include "transcode.hpp"

namespace rosidl_proto {

// What a column is: the numbers of `ColumnKind` in rosidl_adapter_proto/transcode/columns.py.
enum class ColumnKind : uint8_t {
  Number = 1,   // one number
  Numbers = 2,  // an array or sequence of numbers
  Text = 3,     // a string or wide string, as UTF-8
  List = 4,     // an array or sequence; what its elements are is the next column
  Struct = 5,   // a message; its fields follow
  Time = 6,     // a message of the fields `int32 sec`, `uint32 nanosec`, as one int64: nanoseconds
};

// No buffer has more bytes than offsets of 32 bits can tell.
constexpr uint64_t kMaximumColumn = 0x7fffffff;

// How much memory columns may take: each of them, and together not more than twice that.
struct ColumnRoom {
  uint64_t limit;
  uint64_t taken = 0;
};

struct Column {
  static constexpr uint32_t kVariable = 0xffffffff;

  ColumnKind kind = ColumnKind::Struct;
  bool hollow = false;   // nothing inside of it takes any bytes
  bool boolean = false;  // numbers are booleans, which Arrow has as bits
  uint32_t width = 0;    // in bytes, of a value; 0 if what there is lies in other columns
  uint32_t length = 1;   // in values, of a row
  uint32_t span = 1;     // columns until the next one that is not inside of this one
  uint32_t left = 0;     // elements of the last row of a list that are still to come
  uint64_t count = 0;    // rows; only known when the columns are taken
  Memory offsets, values;

  // Whether all rows have the same length, so that there are no offsets.
  bool fixed() const { return length != kVariable; }

  // The same column without rows.
  Column empty() const {
    Column column;
    column.kind = kind;
    column.hollow = hollow;
    column.boolean = boolean;
    column.width = width;
    column.length = length;
    column.span = span;
    return column;
  }
};

class Columns {
 public:
  // No column gets more bytes than `limit`, which is at most kMaximumColumn.
  explicit Columns(uint64_t limit = kMaximumColumn) : room_{limit} {}

  // Reads a layout. Returns nullptr, or what is wrong with it. The plan stays where it is.
  const char* load(const Plan& plan, const uint8_t* layout, size_t size) noexcept;

  // Appends a row. A message that is not valid, or for which there is no room, leaves no trace.
  bool append(Serialization serialization, Input message, Error& error) noexcept;

  uint64_t rows() const { return rows_; }
  // What all of them take.
  uint64_t bytes() const {
    uint64_t sum = rows_ * row_bytes_;
    for (const uint32_t index : variable_)
      sum += columns_[index].offsets.size() + columns_[index].values.size();
    return sum;
  }

  // Hands all rows over and begins anew; false if there is no memory for that, and then nothing is lost.
  bool take(std::vector<Column>* taken) noexcept;

 private:
  const char* add(const Message& message, const uint8_t** layout, const uint8_t* end);
  const char* add_field(const Operation& op, const uint8_t** layout, const uint8_t* end);
  const char* add_element(const Operation& op, const uint8_t** layout, const uint8_t* end);
  Column& push(ColumnKind kind, uint32_t width, uint32_t length);
  bool run(Serialization serialization, Input message, Error& error);
  bool prepare(const std::vector<Column>* before);
  void find_variable(size_t first, size_t last, uint64_t values);
  static Column* cut(Column* column, uint64_t count);

  const Plan* plan_ = nullptr;
  std::unique_ptr<Fields> fields_;
  std::vector<Column> columns_;     // and one more behind the last
  std::vector<uint32_t> variable_;  // the columns whose size does not follow from the number of rows
  uint64_t row_bytes_ = 0;          // of all other columns
  uint64_t rows_ = 0;
  ColumnRoom room_;
};

}  // namespace rosidl_proto
