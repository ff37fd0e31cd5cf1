// CDR to protobuf, protobuf to CDR and ROS 1 to protobuf, each in two steps: measure, then write into a
// buffer of exactly that size. Where there is room anyway, protobuf is written in one step.
//
// Nothing here throws, keeps state or reads past what it was given. The input may even change between the two
// steps: the second one checks every read and write again. Stack use is bounded by kMaximumDepth.
#pragma once

#include <cstdint>
#include <cstdlib>

#include "error.hpp"
#include "plan.hpp"

namespace rosidl_proto {

// The numbers of `SERIALIZATIONS` in rosidl_adapter_proto/transcode/columns.py.
enum class Serialization : uint8_t { Cdr, Protobuf, Ros1 };
constexpr uint8_t kSerializations = 3;

struct Input {
  const uint8_t* data;
  uint64_t size;
};

struct Output {
  uint8_t* data;
  uint64_t size;
};

// The lengths of submessages in the order in which they are met: found while measuring, used while writing.
// One length takes 4 bytes, and there is at most one for each byte of input.
class Lengths {
 public:
  Lengths() = default;
  Lengths(const Lengths&) = delete;
  Lengths& operator=(const Lengths&) = delete;
  ~Lengths() {
    if (data_ != few_) std::free(data_);
  }

  uint64_t size() const { return size_; }
  void clear() { size_ = 0; }
  uint32_t& operator[](uint64_t index) { return data_[index]; }
  uint32_t operator[](uint64_t index) const { return data_[index]; }

  // Appends a place for a length; false if there is no memory for it.
  bool append() {
    if (size_ == capacity_ && !grow()) return false;
    ++size_;
    return true;
  }

 private:
  bool grow();

  static constexpr uint64_t kFew = 64;
  uint32_t few_[kFew];
  uint32_t* data_ = few_;
  uint64_t size_ = 0, capacity_ = kFew;
};

// Where the fields of a protobuf message are. Memory for the longest way down the types, which the plan
// knows; it can be used for any number of messages, one after the other.
class Fields {
 public:
  // What is known about one field.
  struct Slot {
    const uint8_t* first;  // the tag of its first occurrence
    const uint8_t* data;   // delimited: the content of the last occurrence
    uint64_t value;        // number: its last value; delimited: the size of `data`
    uint32_t elements;     // of a repeated number; like all counts below 2^31, the limit of a message
    uint32_t occurrences : 31;
    uint32_t delimited : 1;  // a repeated number was packed when it came last
  };

  explicit Fields(const Plan& plan);
  Fields(const Fields&) = delete;
  Fields& operator=(const Fields&) = delete;
  ~Fields() { std::free(more_); }

  Slot* slots() { return slots_; }  // nullptr if there was no memory

  // The message whose outermost fields are in the slots: left there by measuring, so that writing need not
  // look again.
  const uint8_t* message = nullptr;

 private:
  static constexpr uint64_t kFew = 48;
  Slot few_[kFew];
  Slot* more_ = nullptr;
  Slot* slots_ = few_;
};

// Validates `cdr` and finds the size of the protobuf message; appends to `lengths`.
bool measure_cdr_to_proto(const Plan& plan, Input cdr, uint64_t limit, Lengths& lengths, uint64_t* size,
                          Error& error) noexcept;

// Writes what was measured. `first` is the number of lengths that there were before measuring.
bool write_cdr_to_proto(const Plan& plan, Input cdr, const Lengths& lengths, uint64_t first, Output proto,
                        Error& error) noexcept;

// Validates `cdr` and writes the protobuf message in one step, with bytes behind it that count for nothing.
// The reason is NoRoom if it does not fit.
bool append_cdr_to_proto(const Plan& plan, Input cdr, Output room, uint64_t* size, Error& error) noexcept;

// The same for messages as ROS 1 serializes them. A time after 2038 or a duration with negative nanoseconds,
// which ROS 2 does not have, is an error.
bool measure_ros1_to_proto(const Plan& plan, Input ros1, uint64_t limit, Lengths& lengths, uint64_t* size,
                           Error& error) noexcept;
bool write_ros1_to_proto(const Plan& plan, Input ros1, const Lengths& lengths, uint64_t first, Output proto,
                         Error& error) noexcept;
bool append_ros1_to_proto(const Plan& plan, Input ros1, Output room, uint64_t* size, Error& error) noexcept;

// Finds the size of the CDR message, header included.
bool measure_proto_to_cdr(const Plan& plan, Input proto, uint64_t limit, Fields& fields, uint64_t* size,
                          Error& error) noexcept;

// Validates `proto` and writes little-endian plain CDR.
bool write_proto_to_cdr(const Plan& plan, Input proto, Fields& fields, Output cdr, Error& error) noexcept;

}  // namespace rosidl_proto
