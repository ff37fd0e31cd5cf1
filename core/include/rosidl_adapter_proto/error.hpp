// What is wrong with a message and where: plain data while the message is read, text only when somebody asks.
#pragma once

#include <cstdint>
#include <string>

#include "plan.hpp"

namespace rosidl_proto {

enum class Reason : uint8_t {
  None,
  // of CDR
  Truncated,
  Header,
  Encapsulation,
  CdrValue,
  NoTerminator,
  WstringUnit,
  Trailing,
  // of ROS 1
  WithoutBytes,
  Ros1Time,
  Ros1Duration,
  // of protobuf
  WireTruncated,
  WireVarint,
  WireTag,
  WireType,
  WireGroup,
  WirePacked,
  WireSize,
  ArrayLength,
  Range,
  NulInString,
  OddWstring,
  // of both
  Utf8,
  Utf16,
  StringBound,
  SequenceBound,
  Count,
  TooLarge,
  OutOfMemory,
  Partial,
  ColumnsFull,
  NoRoom,
  Changed,
};
constexpr int64_t kNoElement = -1;

struct Error {
  struct Step {
    uint32_t operation;
    int64_t element;  // kNoElement for the field itself
  };

  Reason reason = Reason::None;
  uint64_t offset = 0;           // in the input
  uint64_t a = 0, b = 0;         // the numbers in the text of the reason
  int64_t element = kNoElement;  // of the field that is being left
  uint32_t depth = 0;
  Step path[kMaximumDepth];  // from the inside to the outside

  // Called once for each message on the way out.
  void leave(uint32_t operation) {
    if (depth < kMaximumDepth) path[depth++] = {operation, element};
    element = kNoElement;
  }
};

// `header.frame_id`, `points[3].x`; empty for the message itself.
std::string field_path(const Error& error, const Plan& plan);

// What is wrong, and what to do.
std::string reason(const Error& error);

}  // namespace rosidl_proto
