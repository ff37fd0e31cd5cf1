// Plain CDR (OMG CORBA 3.3 part 2, section 9.3; DDS-XTypes 1.3, section 7.4.1: encoding version 1): reads
// that check before they read.
//
// A function that reads takes the place where it begins and returns the place after it; nullptr means that
// the error is filled in.
#pragma once

#include "rosidl_adapter_proto/error.hpp"
#include "rosidl_adapter_proto/transcode.hpp"
#include "rosidl_adapter_proto/wire.hpp"

namespace rosidl_proto {
namespace {

constexpr uint64_t kCdrHeader = 4;

// The byte order of plain CDR; false and an error for any other encapsulation. The two bytes of options that
// follow its identifier say nothing about plain CDR.
inline bool byte_order(Input cdr, bool* swapped, Error& error) {
  if (cdr.size < kCdrHeader) {
    error.reason = Reason::Header;
    error.a = cdr.size;
    return false;
  }
  const unsigned id = unsigned{cdr.data[0]} << 8 | cdr.data[1];
  if (id > 1) {
    error.reason = Reason::Encapsulation;
    error.a = id;
    return false;
  }
  *swapped = id == 0;
  return true;
}

// How messages are laid out. ROS 1 has what is CDR without all that CDR adds
// (https://wiki.ros.org/ROS/Technical%20Overview#Message_serialization_and_msg_MD5_sums).
struct PlainCdr {
  static constexpr uint64_t kHeader = kCdrHeader;
  static constexpr bool kAligned = true;     // numbers lie at multiples of their size
  static constexpr bool kTerminated = true;  // a string ends with NUL, which its length counts
  static constexpr bool kPadded = true;      // bytes may follow the last field
  static constexpr bool kFilled = true;      // an empty message has a byte
};
struct Ros1 {
  static constexpr uint64_t kHeader = 0;
  static constexpr bool kAligned = false, kTerminated = false, kPadded = false, kFilled = false;
};

// So many elements that take no bytes a message may have, since its size does not bound them.
constexpr uint32_t kMaximumWithoutBytes = 0x10000;

template <bool kSwap, class Layout = PlainCdr>
class CdrInput {
 public:
  CdrInput(Input cdr, Error& error)
      : origin_(cdr.data + Layout::kHeader), end_(cdr.data + cdr.size), error_(error) {}

  const uint8_t* origin() const { return origin_; }
  uint64_t left(const uint8_t* p) const { return static_cast<uint64_t>(end_ - p); }
  uint64_t offset(const uint8_t* p) const { return static_cast<uint64_t>(p - origin_); }

  const uint8_t* fail(Reason reason, const uint8_t* p, uint64_t a = 0, uint64_t b = 0) {
    error_.reason = reason;
    error_.offset = offset(p) + Layout::kHeader;
    error_.a = a;
    error_.b = b;
    return nullptr;
  }

  // Goes to the alignment of numbers of `size` bytes, counted from after the header, with `size` bytes there.
  ROSIDL_PROTO_INLINE const uint8_t* align_to(const uint8_t* p, uint64_t size) {
    const uint64_t padding = Layout::kAligned ? (0 - offset(p)) & (size - 1) : 0;
    if (left(p) < padding + size) return fail(Reason::Truncated, p, padding + size, left(p));
    return p + padding;
  }

  const uint8_t* need(const uint8_t* p, uint64_t size) {
    if (left(p) < size) return fail(Reason::Truncated, p, size, left(p));
    return p;
  }

  template <class T>
  static T load(const uint8_t* p) {
    const T value = load_little<T>(p);
    return kSwap ? swap(value) : value;
  }

  const uint8_t* count(const uint8_t* p, uint32_t* count) {
    if ((p = align_to(p, 4)) == nullptr) return nullptr;
    *count = load<uint32_t>(p);
    return p + 4;
  }

  // Reads the count of a sequence or takes that of an array; checks it against the bound and against what is
  // left, of which an element needs at least `minimum` bytes.
  const uint8_t* elements(const Operation& op, const uint8_t* p, uint64_t minimum, uint32_t* number) {
    *number = op.count;
    const uint8_t* const before = p;
    if (op.shape == Shape::Sequence) {
      if ((p = count(p, number)) == nullptr) return nullptr;
      if (*number > op.count) return fail(Reason::SequenceBound, p - 4, *number, op.count);
    }
    if (!Layout::kFilled && minimum == 0) return elements_without_bytes(before, *number) ? p : nullptr;
    // `minimum` is at most 2^40 and the count below 2^32: the division keeps the product out.
    if (*number > left(p) / minimum) return fail(Reason::Count, before, *number, left(p));
    return p;
  }

 private:
  bool elements_without_bytes(const uint8_t* p, uint32_t number) {
    if (number > without_bytes_)
      return fail(Reason::WithoutBytes, p, number, kMaximumWithoutBytes) != nullptr;
    without_bytes_ -= number;
    return true;
  }

  const uint8_t* const origin_;
  const uint8_t* const end_;
  Error& error_;
  uint32_t without_bytes_ = kMaximumWithoutBytes;  // that may still come
};

// Numbers that stand side by side in CDR.
template <class F, bool kSwap>
class CdrNumbers {
 public:
  using Raw = typename F::Raw;

  CdrNumbers(const uint8_t* data, uint64_t count) : data_(data), count_(count) {}

  uint64_t count() const { return count_; }
  static constexpr bool absent() { return false; }
  const uint8_t* bytes() const {
    return F::kCopiesToProtobuf && (!kSwap || sizeof(Raw) == 1) ? data_ : nullptr;
  }
  const uint8_t* place(uint64_t index) const { return data_ + index * sizeof(Raw); }
  Raw operator[](uint64_t index) const { return CdrInput<kSwap>::template load<Raw>(place(index)); }

  template <class Visit>
  bool each(Visit visit) const {
    for (uint64_t i = 0; i < count_; ++i) {
      if (!visit((*this)[i])) return false;
    }
    return true;
  }

 private:
  const uint8_t* data_;
  uint64_t count_;
};

// The code units of a wide string, each of which takes 4 bytes in CDR.
template <bool kSwap>
class CdrUnits {
 public:
  CdrUnits(const uint8_t* data, uint64_t count) : data_(data), count_(count) {}

  uint64_t count() const { return count_; }
  const uint8_t* place(uint64_t index) const { return data_ + index * 4; }
  uint32_t operator[](uint64_t index) const { return CdrInput<kSwap>::template load<uint32_t>(place(index)); }

 private:
  const uint8_t* data_;
  uint64_t count_;
};

}  // namespace
}  // namespace rosidl_proto
