// The plan: what one type looks like in CDR and in protobuf, as a flat array of operations.
//
// A plan comes in as bytes (see rosidl_adapter_proto/transcode/plan.py for the layout) and is checked when it
// is loaded, so that nothing a plan says can make a later read or write go wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace rosidl_proto {

// Deeper nesting is refused. Plans cannot recur, so this bounds the stack for every input.
constexpr uint32_t kMaximumDepth = 100;

// The largest protobuf message, and the largest result
// (https://protobuf.dev/programming-guides/encoding/#size-limit).
constexpr uint64_t kMaximumSize = 0x7fffffff;

// "No bound", for counts and for string lengths.
constexpr uint32_t kUnbounded = 0xffffffff;

// What one element is. The comments give CDR | protobuf.
enum class Kind : uint8_t {
  Placeholder,  // the member of an empty struct: one byte 0 | never written
  Bool,         // 1 byte, 0 or 1 | bool
  Uint8,        // 1 byte | uint32, arrays: bytes
  Int8,         // 1 byte | int32, arrays: bytes
  Char,         // 1 byte | uint32, arrays: string
  Uint16,       // 2 bytes | uint32
  Int16,        // 2 bytes | int32
  Wchar,        // 2 bytes, a UTF-16 code unit (Fast CDR 2) | uint32, arrays: string
  Fixed32,      // 4 bytes | fixed32, sfixed32, float
  Fixed64,      // 8 bytes | fixed64, sfixed64, double
  String,       // uint32 length with NUL, bytes | string
  Wstring,      // uint32 count, 4 bytes for each UTF-16 code unit | bytes: UTF-16LE
  Message,      // its fields | submessage
};
constexpr uint8_t kKinds = 13;

enum class Shape : uint8_t { Single, Array, Sequence };
constexpr uint8_t kShapes = 3;

// https://protobuf.dev/programming-guides/encoding/#structure
enum class WireType : uint8_t {
  Varint = 0,
  Fixed64 = 1,
  Delimited = 2,
  GroupStart = 3,
  GroupEnd = 4,
  Fixed32 = 5
};

struct Operation {
  Kind kind;
  Shape shape;
  WireType wire_type;     // of one element
  bool packable;          // a repeated number, which comes packed or not
  bool omit_empty;        // an empty submessage is left out
  uint8_t tag_size;       // 1 to 5
  uint64_t tag;           // as written: the first `tag_size` bytes, then zeros
  uint64_t tag_mask;      // 0xff for each byte of the tag
  uint32_t number;        // field number
  uint32_t count;         // array: its length; sequence: its bound
  uint32_t string_bound;  // in characters
  uint32_t message;       // index of the nested message
  uint32_t next;          // index of the operation with the next higher field number in the same message
  uint32_t name, name_size;
  uint32_t place[8];  // of a message of fixed size: where the field begins, for each start offset modulo 8
};

struct Message {
  uint32_t first, count;     // its operations
  uint32_t lowest;           // index of the operation with the lowest field number
  uint32_t slots;            // operations along the longest way down from here, itself included
  bool fixed;                // every value has the same size in CDR
  uint64_t minimum_size;     // in CDR, without alignment
  uint64_t default_size[8];  // in CDR, of the default value, for each start offset modulo 8
  uint64_t full_size[8];     // the same with everything at its bound; more than kMaximumSize if unbounded
};

class Plan {
 public:
  // Reads a plan. Returns nullptr, or what is wrong with it.
  const char* load(const uint8_t* data, size_t size) noexcept;

  const Message& root() const { return messages_[0]; }
  const Message& message(uint32_t index) const { return messages_[index]; }
  const Operation& operation(uint32_t index) const { return operations_[index]; }
  const Operation* begin(const Message& message) const { return operations_.data() + message.first; }
  const Operation* end(const Message& message) const { return begin(message) + message.count; }
  std::string name(uint32_t operation) const;

  // The operation of `message` with this field number, or nullptr.
  const Operation* find(const Message& message, uint32_t number) const;

 private:
  const char* read(const uint8_t* data, size_t size);
  const char* derive();
  const char* derive(Message& message);

  std::vector<Message> messages_;
  std::vector<Operation> operations_;
  std::vector<uint32_t> by_number_;  // of each message's operations, in the place of its operations
  std::string names_;
};

}  // namespace rosidl_proto
