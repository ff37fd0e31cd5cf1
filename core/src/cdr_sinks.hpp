// Sinks that make little-endian plain CDR: one finds its size, one writes it.
#pragma once

#include "cdr.hpp"
#include "sink.hpp"

namespace rosidl_proto {
namespace {

// Finds the size. A position counts from after the header.
class CdrSize : public Stop {
 public:
  using At = uint64_t;
  static constexpr bool kSizesOnly = true, kPlaces = false, kMakesCdr = true;

  struct Nested {
    At at;
  };

  explicit CdrSize(uint64_t limit) : limit_(limit) {}

  static bool failed(At at) { return at == kFailed; }
  static At failure() { return kFailed; }

  template <class F>
  At number(const Operation&, At at, typename F::Raw) {
    return align(at, F::kSize) + F::kSize;
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At at, const Numbers& numbers) {
    if (op.shape == Shape::Sequence) at = align(at, 4) + 4;
    if (numbers.count() != 0) at = align(at, F::kSize) + F::kSize * numbers.count();
    return within_limit(at);
  }

  At elements(const Operation& op, At at, uint64_t count) {
    if (op.shape == Shape::Sequence) at = align(at, 4) + 4;
    return count == 0 ? within_limit(at) : at;  // else an element that does not fit is named
  }

  At string(const Operation&, At at, int64_t, Text text) {
    return within_limit(align(at, 4) + 4 + text.size + 1);
  }

  At bytes(const Operation&, At at, int64_t, Text bytes) {
    return within_limit(align(at, 4) + 4 + bytes.size);
  }

  template <class Units>
  At wstring(const Operation&, At at, int64_t, const Units& units) {
    return within_limit(align(at, 4) + 4 + units.count() * 4);
  }

  Nested begin(const Operation&, At at, int64_t) { return {at}; }

  At end(const Operation&, At, const Nested&, At at) { return within_limit(at); }

  // Messages that are empty in protobuf, or that always have the same size.
  At defaults(const Message& message, At at, uint64_t count) {
    return at + message.default_size.from(at, count);
  }

  bool finish(At at) { return !failed(within_limit(at)); }

  At within_limit(At at) {
    if (at + kCdrHeader <= limit_) return at;
    reason = Reason::TooLarge;
    detail = limit_;
    return kFailed;
  }

 private:
  static constexpr At kFailed = ~uint64_t{0};

  const uint64_t limit_;
};

// Writes what `CdrSize` measured.
class CdrWriter : public Stop {
 public:
  using At = uint8_t*;
  static constexpr bool kSizesOnly = false, kPlaces = true, kMakesCdr = true;

  struct Nested {
    At at;
  };

  explicit CdrWriter(Output cdr) : origin_(cdr.data + kCdrHeader), end_(cdr.data + cdr.size) {}

  At origin() const { return origin_; }
  static bool failed(At at) { return at == nullptr; }
  static At failure() { return nullptr; }

  template <class F>
  At number(const Operation&, At out, typename F::Raw raw) {
    return put(out, raw);
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At out, const Numbers& numbers) {
    using Raw = typename F::Raw;
    if (op.shape == Shape::Sequence && (out = put(out, static_cast<uint32_t>(numbers.count()))) == nullptr)
      return nullptr;
    const uint64_t size = numbers.count() * F::kSize;
    if (size == 0) return out;
    if ((out = make_room(out, F::kSize, size)) == nullptr) return nullptr;
    uint8_t* const last = out + size;
    if (numbers.absent()) {
      std::memset(out, 0, static_cast<size_t>(size));
      return last;
    }
    if (const uint8_t* const bytes = numbers.bytes()) {
      copy(out, bytes, size);
      return last;
    }
    const bool good = numbers.each([&](Raw raw) {
      if (out == last) return changed() != nullptr;
      store_little(out, raw);
      out += sizeof(Raw);
      return true;
    });
    if (!good) return nullptr;
    return out == last ? out : changed();
  }

  At elements(const Operation& op, At out, uint64_t count) {
    return op.shape == Shape::Sequence ? put(out, static_cast<uint32_t>(count)) : out;
  }

  At string(const Operation&, At out, int64_t, Text text) {
    if ((out = make_room(out, 4, 4 + text.size + 1)) == nullptr) return nullptr;
    store_little(out, static_cast<uint32_t>(text.size + 1));
    copy(out + 4, text.data, text.size);
    out[4 + text.size] = 0;
    return out + 4 + text.size + 1;
  }

  At bytes(const Operation&, At out, int64_t, Text bytes) {
    if ((out = make_room(out, 4, 4 + bytes.size)) == nullptr) return nullptr;
    store_little(out, static_cast<uint32_t>(bytes.size));
    copy(out + 4, bytes.data, bytes.size);
    return out + 4 + bytes.size;
  }

  template <class Units>
  At wstring(const Operation&, At out, int64_t, const Units& units) {
    if ((out = make_room(out, 4, 4 + units.count() * 4)) == nullptr) return nullptr;
    store_little(out, static_cast<uint32_t>(units.count()));
    out += 4;
    for (uint64_t i = 0; i < units.count(); ++i, out += 4) store_little(out, uint32_t{units[i]});
    return out;
  }

  Nested begin(const Operation&, At out, int64_t) { return {out}; }

  At end(const Operation&, At, const Nested&, At out) { return out; }

  bool finish(At out) { return out == end_ || changed() != nullptr; }

  // The default of a message of fixed size; its fields can then be written in any order, each to its place.
  At zeros(const Message& message, At out) {
    const uint64_t size = message.default_size.from(position(out));
    if ((out = make_room(out, 1, size)) == nullptr) return nullptr;
    std::memset(out, 0, static_cast<size_t>(size));
    return out + size;
  }

  uint64_t position(const uint8_t* out) const { return static_cast<uint64_t>(out - origin_); }

 private:
  At changed() {
    reason = Reason::Changed;
    return nullptr;
  }

  // Fills with zeros up to the alignment of numbers of `alignment` bytes; there is room for `size` bytes
  // after it.
  uint8_t* make_room(uint8_t* out, uint64_t alignment, uint64_t size) {
    const uint64_t padding = (0 - position(out)) & (alignment - 1);
    if (static_cast<uint64_t>(end_ - out) < padding + size) return changed();
    for (uint64_t i = 0; i < padding; ++i) *out++ = 0;
    return out;
  }

  template <class T>
  uint8_t* put(uint8_t* out, T value) {
    if ((out = make_room(out, sizeof(T), sizeof(T))) == nullptr) return nullptr;
    store_little(out, value);
    return out + sizeof(T);
  }

  uint8_t* const origin_;
  uint8_t* const end_;
};

}  // namespace
}  // namespace rosidl_proto
