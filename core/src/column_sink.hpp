// A sink that fills columns: one value, offset or run of values for each field.
//
// A place in this sink is a column. Columns stand in the order in which readers come to fields, so each call
// goes on at the next column; only the elements of a list come to the same columns again.
#pragma once

#include <algorithm>
#include <type_traits>

#include "cdr.hpp"
#include "rosidl_adapter_proto/columns.hpp"
#include "rosidl_adapter_proto/wire.hpp"
#include "sink.hpp"
#include "text.hpp"

namespace rosidl_proto {
namespace {

// Makes room for `size` more bytes.
ROSIDL_PROTO_NO_INLINE inline Reason grow(Memory& memory, uint64_t size, ColumnRoom& room) {
  constexpr uint64_t kFirst = 64;
  const uint64_t needed = memory.size() + size, others = room.taken - memory.capacity();
  const uint64_t most = std::min(room.limit, 2 * room.limit - std::min(others, 2 * room.limit));
  if (needed > most) return Reason::ColumnsFull;
  const uint64_t capacity = std::min(std::max({needed, memory.capacity() * 2, kFirst}), most);
  if (!memory.grow(std::max<uint64_t>(capacity, 1))) return Reason::OutOfMemory;
  room.taken = others + memory.capacity();
  return Reason::None;
}

class ColumnSink : public Stop {
 public:
  using At = Column*;
  static constexpr bool kSizesOnly = false, kPlaces = false, kMakesCdr = false;

  struct Nested {
    At at;
  };

  explicit ColumnSink(ColumnRoom& room) : room_(room) {}

  static bool failed(At at) { return at == nullptr; }
  static At failure() { return nullptr; }

  template <class F>
  ROSIDL_PROTO_INLINE At number(const Operation&, At at, typename F::Raw raw) {
    if constexpr (std::is_same_v<F, Form<CdrForm::Int32>>) {
      if (at->kind == ColumnKind::Time) {
        constexpr int64_t kNanoseconds = 1000000000;
        return put(at->values, static_cast<int32_t>(raw) * kNanoseconds) ? at : nullptr;
      }
    } else if constexpr (std::is_same_v<F, Form<CdrForm::Uint32>>) {
      if (at->kind == ColumnKind::Time) {
        uint8_t* const seconds = end_of(at->values) - sizeof(int64_t);
        store_little(seconds, load_little<int64_t>(seconds) + int64_t{raw});
        return at;
      }
    }
    return put(at->values, raw) ? at + 1 : nullptr;
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At at, const Numbers& numbers) {
    using Raw = typename F::Raw;
    const uint64_t size = numbers.count() * F::kSize;
    uint8_t* out = room(at->values, size);
    if (out == nullptr) return nullptr;
    if (numbers.absent()) {
      std::memset(out, 0, static_cast<size_t>(size));
    } else if (const uint8_t* const bytes = numbers.bytes()) {
      copy(out, bytes, size);
    } else {
      const uint8_t* const last = out + size;
      const bool good = numbers.each([&](Raw raw) {
        if (out == last) return stop(Reason::Changed) != nullptr;
        store_little(out, raw);
        out += sizeof(Raw);
        return true;
      });
      if (!good) return nullptr;
      if (out != last) return stop(Reason::Changed);
    }
    return end_values(op, at, at->values.size() / F::kSize);
  }

  At elements(const Operation& op, At at, uint64_t count) {
    // What takes no memory still takes time.
    if (at->hollow && count > without_bytes_) return stop(Reason::ColumnsFull);
    if (at->hollow) without_bytes_ -= count;
    if (op.shape == Shape::Sequence) {
      const uint64_t before = load_little<uint32_t>(end_of(at->offsets) - sizeof(uint32_t));
      if (before + count > room_.limit) return stop(Reason::ColumnsFull);
      if (!put(at->offsets, static_cast<uint32_t>(before + count))) return nullptr;
    }
    at->left = static_cast<uint32_t>(count);
    return at + (count == 0 ? at->span : 1);
  }

  At string(const Operation& op, At at, int64_t, Text text) {
    uint8_t* const out = room(at->values, text.size);
    if (out == nullptr) return nullptr;
    copy_text(out, text);
    return end_string(op, at);
  }

  At bytes(const Operation& op, At at, int64_t element, Text bytes) { return string(op, at, element, bytes); }

  // As with text in protobuf, half of a surrogate pair is an error.
  template <class Units>
  At wstring(const Operation& op, At at, int64_t, const Units& units) {
    uint8_t* out = room(at->values, units.count() * 4);  // more than any code unit takes
    if (out == nullptr) return nullptr;
    uint32_t high = 0;
    for (uint64_t i = 0; i < units.count(); ++i) {
      uint32_t unit = units[i];
      if (is_low_surrogate(unit) != (high != 0)) return stop(Reason::Utf16);
      if (high != 0) unit = join_surrogates(high, unit);
      high = is_high_surrogate(unit) ? unit : 0;
      if (high == 0) out = put_utf8(out, unit);
    }
    if (high != 0) return stop(Reason::Utf16);
    at->values.cut(static_cast<uint64_t>(out - at->values.data()));
    return end_string(op, at);
  }

  Nested begin(const Operation&, At at, int64_t) { return {at->kind == ColumnKind::Time ? at : at + 1}; }

  At end(const Operation& op, At at, const Nested&, At inner) {
    return end_element(op, at, at->kind == ColumnKind::Time ? at + 1 : inner);
  }

  bool finish(At) { return true; }

 private:
  At stop(Reason why) {
    reason = why;
    detail = why == Reason::ColumnsFull ? room_.limit : 0;
    return nullptr;
  }

  static uint8_t* end_of(Memory& memory) { return memory.data() + memory.size(); }

  // Returns the place for `size` bytes behind what there is.
  ROSIDL_PROTO_INLINE uint8_t* room(Memory& memory, uint64_t size) {
    if (size > memory.capacity() - memory.size()) {
      const Reason why = grow(memory, size, room_);
      if (why != Reason::None) return stop(why), nullptr;
    }
    uint8_t* const place = end_of(memory);
    memory.add(size);
    return place;
  }

  // As `copy`, without a call for the few bytes that most texts have.
  static void copy_text(uint8_t* to, Text text) {
    if (text.size > 16) {
      std::memcpy(to, text.data, static_cast<size_t>(text.size));
    } else if (text.size >= 8) {
      const auto last = load_little<uint64_t>(text.data + text.size - 8);
      store_little(to, load_little<uint64_t>(text.data));
      store_little(to + text.size - 8, last);
    } else if (text.size >= 4) {
      const auto last = load_little<uint32_t>(text.data + text.size - 4);
      store_little(to, load_little<uint32_t>(text.data));
      store_little(to + text.size - 4, last);
    } else {
      for (uint64_t i = 0; i < text.size; ++i) to[i] = text.data[i];
    }
  }

  template <class T>
  ROSIDL_PROTO_INLINE bool put(Memory& memory, T value) {
    uint8_t* const out = room(memory, sizeof(T));
    if (out == nullptr) return false;
    store_little(out, value);
    return true;
  }

  At end_values(const Operation& op, At at, uint64_t count) {
    if (op.shape != Shape::Sequence) return at + 1;
    return put(at->offsets, static_cast<uint32_t>(count)) ? at + 1 : nullptr;
  }

  At end_string(const Operation& op, At at) {
    if (!put(at->offsets, static_cast<uint32_t>(at->values.size()))) return nullptr;
    return end_element(op, at, at + 1);
  }

  // An element of a list stands right behind the list.
  static At end_element(const Operation& op, At at, At behind) {
    return op.shape == Shape::Single || --at[-1].left == 0 ? behind : at;
  }

  ColumnRoom& room_;
  uint64_t without_bytes_ = kMaximumWithoutBytes;  // elements that may still come
};

}  // namespace
}  // namespace rosidl_proto
