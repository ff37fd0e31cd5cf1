// The plan: what one type looks like in CDR and in protobuf, as a flat array of operations.
//
// A plan comes in as bytes (see rosidl_adapter_proto/transcode/plan.py for the layout) and is checked when it
// is loaded, so that nothing a plan says can make a later read or write go wrong.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "forms.hpp"

namespace rosidl_proto {

// The version of packed plans, which is a digit in them: VERSION in plan.py.
constexpr int kPlanVersion = 2;

// How a packed plan begins, and the sizes of its parts.
constexpr char kPlanMark[] = {'R', 'P', 'P', '0' + kPlanVersion};
constexpr size_t kPlanHeaderBytes = 20, kPlanMessageBytes = 24, kPlanOperationBytes = 40;

// Deeper nesting is refused. Plans cannot recur, so this bounds the stack for every input.
constexpr uint32_t kMaximumDepth = 100;

// The largest protobuf message, and the largest result
// (https://protobuf.dev/programming-guides/encoding/#size-limit).
constexpr uint64_t kMaximumSize = 0x7fffffff;

// https://protobuf.dev/programming-guides/proto3/#assigning
constexpr uint32_t kMaximumFieldNumber = (1u << 29) - 1;

// "No bound", for counts and for string lengths.
constexpr uint32_t kUnbounded = 0xffffffff;

enum class Shape : uint8_t { Single, Array, Sequence };
constexpr uint8_t kShapes = 3;

// How a field is read: alone, several times, or not at all since protobuf does not have it.
enum class Reading : uint8_t { One, Many, Skip };

// A name: its place in the names of the plan.
struct Name {
  uint32_t place, size;
};

struct Operation {
  // As in the plan.
  CdrForm cdr;
  ProtobufForm protobuf;
  Shape shape;
  uint8_t scalar;   // the type id of an element (REP-2011)
  bool omit_empty;  // an empty submessage is left out

  // What follows from that. What each field needs comes first, so that it lies together in memory.
  Reading reading;
  WireType wire_type;  // of one element
  bool packable;       // a repeated number, which comes packed or not
  uint8_t tag_size;    // 1 to 5
  bool filler;         // what ROS 2 has in an empty message, and ROS 1 has not
  bool other_sign;     // a number with a sign in ROS 2 or in ROS 1, but not in both
  uint64_t tag;        // as written: the first `tag_size` bytes, then zeros
  uint64_t tag_mask;   // 0xff for each byte of the tag
  uint32_t next;       // index of the operation with the next higher field number in the same message

  uint32_t count;         // array: its length; sequence: its bound
  uint32_t string_bound;  // in characters
  uint32_t message;       // index of the nested message
  uint32_t number;        // field number
  uint32_t place[8];  // of a message of fixed size: where the field begins, for each start offset modulo 8
  Name name, protobuf_name;
};

// How far a value moves an offset, for each offset modulo 8, which decides its padding.
struct Advance {
  uint64_t by[8];

  uint64_t from(uint64_t offset) const { return by[offset & 7]; }

  // The same for `count` values, one after the other. After one value, offsets differ by multiples of its
  // largest alignment, whatever they were before: so all values but the first move them alike.
  uint64_t from(uint64_t offset, uint64_t count) const {
    if (count == 0) return 0;
    const uint64_t first = from(offset);
    return first + (count - 1) * from(offset + first);
  }
};

struct Message {
  Name name, protobuf_name;
  uint32_t first, count;  // its operations

  uint32_t lowest;        // index of the operation with the lowest field number
  uint32_t slots;         // operations along the longest way down from here, itself included
  bool fixed;             // every value has the same size in CDR
  uint64_t minimum_size;  // in CDR, without alignment
  uint64_t ros1_minimum_size;
  Advance default_size;  // in CDR, of the default value
  Advance full_size;     // the same with everything at its bound; more than kMaximumSize if unbounded
};

class Plan {
 public:
  // Reads a plan. Returns nullptr, or what is wrong with it.
  const char* load(const uint8_t* data, size_t size) noexcept;

  // Fields are missing: nothing is known of what follows the last one, and CDR cannot be written.
  bool partial() const { return partial_; }

  const Message& root() const { return messages_[0]; }
  const Message& message(uint32_t index) const { return messages_[index]; }
  uint32_t message_count() const { return static_cast<uint32_t>(messages_.size()); }
  uint32_t operation_count() const { return static_cast<uint32_t>(operations_.size()); }
  const Operation& operation(uint32_t index) const { return operations_[index]; }
  const Operation* begin(const Message& message) const { return operations_.data() + message.first; }
  const Operation* end(const Message& message) const { return begin(message) + message.count; }
  std::string text(Name name) const { return names_.substr(name.place, name.size); }
  const std::string& names() const { return names_; }  // all of them

  // The operation of `message` with this field number, or nullptr.
  const Operation* find(const Message& message, uint32_t number) const;

 private:
  const char* read(const uint8_t* data, size_t size);
  const char* derive();
  const char* derive(Message& message);
  void derive_ros1(const Message& message, Operation& op) const;
  const char* order(Message& message);

  std::vector<Message> messages_;
  std::vector<Operation> operations_;
  std::vector<uint32_t> by_number_;  // of each message's operations, in the place of its operations
  std::string names_;
  bool partial_ = false;
};

}  // namespace rosidl_proto
