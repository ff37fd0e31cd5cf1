// Sinks that make protobuf (https://protobuf.dev/programming-guides/encoding/): one finds its size, one
// writes what was measured, and one writes what was not.
//
// Fields are written in the order in which they come, which protobuf allows (any order is valid). Defaults
// are left out, as every proto3 serializer does.
#pragma once

#include "rosidl_adapter_proto/transcode.hpp"
#include "rosidl_adapter_proto/wire.hpp"
#include "sink.hpp"
#include "text.hpp"

namespace rosidl_proto {
namespace {

// The bytes that a number takes without its tag; at most 16 bits as varints take 1, 2 or 3 bytes, or 10 if
// negative.
template <class F>
inline uint64_t wire_size(typename F::Raw raw) {
  if constexpr (F::kWireType == WireType::Varint) {
    const uint64_t value = F::to_wire(raw);
    if constexpr (F::kSize > 2) return varint_size(value);
    return value > 0xffff ? kMaximumVarintBytes : 1u + (value >= 0x80) + (value >= 0x4000);
  } else {
    return F::kWireType == WireType::Fixed64 ? 8 : 4;
  }
}

// Whether the size of an array or sequence follows from its number of elements.
template <class F>
constexpr bool kCountTellsSize = F::kCopiesToProtobuf || F::kWireType != WireType::Varint;

template <class F>
constexpr uint64_t kElementSize = F::kCopiesToProtobuf                ? F::kSize
                                  : F::kWireType == WireType::Fixed64 ? 8
                                                                      : 4;

// Finds the size, and appends the lengths of submessages to `lengths`, as well as those of arrays whose
// number of elements does not tell.
class ProtobufSize : public Stop {
 public:
  using At = uint64_t;
  static constexpr bool kSizesOnly = false, kPlaces = false, kMakesCdr = false;

  struct Nested {
    At at;
    uint64_t length;  // its place among the lengths
  };

  ProtobufSize(Lengths& lengths, uint64_t limit) : lengths_(lengths), limit_(limit) {}

  static bool failed(At at) { return at == kFailed; }
  static At failure() { return kFailed; }

  template <class F>
  ROSIDL_PROTO_INLINE At number(const Operation& op, At at, typename F::Raw raw) {
    return at + (raw == 0 ? 0 : op.tag_size + wire_size<F>(raw));
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At at, const Numbers& numbers) {
    if constexpr (kCountTellsSize<F>) {
      return delimited(op, at, numbers.count() * kElementSize<F>);
    } else {
      if (numbers.count() == 0) return at;
      uint64_t size = 0;
      numbers.each([&size](typename F::Raw raw) {
        // Both halves of a surrogate pair together take 4 bytes.
        size += !F::kIsText ? wire_size<F>(raw) : is_surrogate(raw) ? 2 : utf8_size(raw);
        return true;
      });
      if (size > limit_) return too_large();
      if (!lengths_.append()) return stop(Reason::OutOfMemory);
      lengths_[lengths_.size() - 1] = static_cast<uint32_t>(size);
      return delimited(op, at, size);
    }
  }

  At elements(const Operation&, At at, uint64_t) { return at; }

  At string(const Operation& op, At at, int64_t element, Text text) {
    return element == kNoElement ? delimited(op, at, text.size) : always_delimited(op, at, text.size);
  }

  At bytes(const Operation& op, At at, int64_t element, Text bytes) { return string(op, at, element, bytes); }

  template <class Units>
  At wstring(const Operation& op, At at, int64_t element, const Units& units) {
    return string(op, at, element, Text{nullptr, units.count() * 2});
  }

  Nested begin(const Operation&, At, int64_t) {
    if (!lengths_.append()) return {stop(Reason::OutOfMemory), 0};
    return {0, lengths_.size() - 1};
  }

  At end(const Operation& op, At at, const Nested& nested, At size) {
    if (size > limit_) return too_large();
    lengths_[nested.length] = static_cast<uint32_t>(size);
    if (size == 0 && op.omit_empty && op.shape == Shape::Single) return at;
    return always_delimited(op, at, size);
  }

  bool finish(At at) { return at <= limit_ || !failed(too_large()); }

 private:
  static constexpr At kFailed = ~uint64_t{0};

  At stop(Reason why, uint64_t what = 0) {
    reason = why;
    detail = what;
    return kFailed;
  }
  At too_large() { return stop(Reason::TooLarge, limit_); }

  static At always_delimited(const Operation& op, At at, uint64_t size) {
    return at + op.tag_size + varint_size(size) + size;
  }

  static At delimited(const Operation& op, At at, uint64_t size) {
    return size == 0 ? at : always_delimited(op, at, size);
  }

  Lengths& lengths_;
  const uint64_t limit_;
};

// Writes what `ProtobufSize` measured, or what was not measured: then the length of a submessage is known
// when it ends, and what is behind a length that takes more than one byte moves.
template <bool kMeasured>
class ProtobufOutput : public Stop {
 public:
  using At = uint8_t*;
  static constexpr bool kSizesOnly = false, kPlaces = false, kMakesCdr = false;

  struct Nested {
    At at;
    At end;
  };

  // `first` is the place of the first length; there are none of what was not measured.
  ProtobufOutput(Output proto, const Lengths& lengths, uint64_t first)
      : lengths_(lengths), place_(first), end_(proto.data + proto.size) {}

  static bool failed(At at) { return at == nullptr; }
  static At failure() { return nullptr; }

  template <class F>
  ROSIDL_PROTO_INLINE At number(const Operation& op, At out, typename F::Raw raw) {
    if (raw == 0) return out;
    const uint64_t value = F::to_wire(raw);
    if constexpr (F::kWireType == WireType::Varint) {
      if (!room(out, op.tag_size + varint_size(value))) return full();
      return put_varint(put_tag(out, op), value);
    } else {
      if (!room(out, op.tag_size + wire_size<F>(raw))) return full();
      return put_fixed<F>(put_tag(out, op), value);
    }
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At out, const Numbers& numbers) {
    if (numbers.count() == 0) return out;
    uint64_t size = numbers.count() * kElementSize<F>;
    if constexpr (F::kCopiesToProtobuf) {
      if (const uint8_t* const bytes = numbers.bytes()) return delimited(op, out, Text{bytes, size});
    }
    constexpr bool kOpen = !kMeasured && !kCountTellsSize<F>;
    if (kMeasured && !kCountTellsSize<F> && !next_length(&size)) return full();
    out = kOpen ? open(op, out) : begin_delimited(op, out, size);
    if (out == nullptr) return full();
    uint8_t* const content = out;
    bool good;
    if constexpr (F::kIsText) {
      good = put_text<F>(numbers, &out);
    } else if constexpr (F::kWireType == WireType::Varint) {
      good = numbers.each([&](typename F::Raw raw) {
        const uint64_t value = F::to_wire(raw);
        if (!room(out, varint_size(value))) return full() != nullptr;
        out = put_varint(out, value);
        return true;
      });
    } else {
      good = numbers.each([&](typename F::Raw raw) {
        out = put_fixed<F>(out, F::to_wire(raw));
        return true;
      });
    }
    if (!good) return nullptr;
    return kOpen ? close(content, out) : out;
  }

  At elements(const Operation&, At out, uint64_t) { return out; }

  At string(const Operation& op, At out, int64_t element, Text text) {
    return text.size == 0 && element == kNoElement ? out : delimited(op, out, text);
  }

  At bytes(const Operation& op, At out, int64_t element, Text bytes) {
    return string(op, out, element, bytes);
  }

  template <class Units>
  At wstring(const Operation& op, At out, int64_t element, const Units& units) {
    if (units.count() == 0 && element == kNoElement) return out;
    if ((out = begin_delimited(op, out, units.count() * 2)) == nullptr) return full();
    for (uint64_t i = 0; i < units.count(); ++i, out += 2) store_little(out, static_cast<uint16_t>(units[i]));
    return out;
  }

  Nested begin(const Operation& op, At out, int64_t) {
    uint64_t size = 0;
    if constexpr (kMeasured) {
      if (!next_length(&size)) return {full(), nullptr};
      if (size == 0 && is_omitted(op)) return {out, out};
    }
    out = kMeasured ? begin_delimited(op, out, size) : open(op, out);
    return out == nullptr ? Nested{full(), nullptr} : Nested{out, out + size};
  }

  At end(const Operation& op, At at, const Nested& nested, At out) {
    if constexpr (kMeasured) return out == nested.end ? out : full();
    return out == nested.at && is_omitted(op) ? at : close(nested.at, out);
  }

  bool finish(At out) { return !kMeasured || out == end_ || !failed(full()); }

 private:
  // There is no room, which there always is for what was measured and is still the same.
  At full() {
    reason = kMeasured ? Reason::Changed : Reason::NoRoom;
    return nullptr;
  }

  static bool is_omitted(const Operation& op) { return op.omit_empty && op.shape == Shape::Single; }

  bool room(const uint8_t* out, uint64_t size) const { return static_cast<uint64_t>(end_ - out) >= size; }

  // Needs `op.tag_size` bytes; uses 8 where there are 8, since one store is faster than a copy of unknown
  // size.
  uint8_t* put_tag(uint8_t* out, const Operation& op) const {
    if (room(out, 8)) {
      store_little(out, op.tag);
    } else {
      std::memcpy(out, &op.tag, op.tag_size);
    }
    return out + op.tag_size;
  }

  template <class F>
  static uint8_t* put_fixed(uint8_t* out, uint64_t value) {
    if constexpr (F::kWireType == WireType::Fixed64) {
      store_little(out, value);
      return out + 8;
    } else {
      store_little(out, static_cast<uint32_t>(value));
      return out + 4;
    }
  }

  // Writes UTF-16 code units as UTF-8.
  template <class F, class Numbers>
  bool put_text(const Numbers& numbers, uint8_t** to) {
    uint8_t* out = *to;
    uint32_t high = 0;
    const bool good = numbers.each([&](uint32_t unit) {
      if (is_high_surrogate(unit)) {
        high = unit;
        return true;
      }
      if (high != 0) unit = join_surrogates(high, unit);
      high = 0;
      if (!room(out, utf8_size(unit))) return full() != nullptr;
      out = put_utf8(out, unit);
      return true;
    });
    *to = out;
    return good;
  }

  bool next_length(uint64_t* size) {
    if (place_ == lengths_.size()) return false;
    *size = lengths_[place_++];
    return true;
  }

  // Writes tag and length if they and the content fit; returns nullptr if not.
  uint8_t* begin_delimited(const Operation& op, uint8_t* out, uint64_t size) {
    if (!room(out, op.tag_size + varint_size(size) + size)) return nullptr;
    return put_varint(put_tag(out, op), size);
  }

  // Writes a tag, and keeps a byte for the length; returns nullptr if there is no room.
  uint8_t* open(const Operation& op, uint8_t* out) const {
    return room(out, op.tag_size + uint64_t{1}) ? put_tag(out, op) + 1 : nullptr;
  }

  // Writes the length of what begins at `content` and ends at `out`.
  At close(uint8_t* content, uint8_t* out) {
    const auto size = static_cast<uint64_t>(out - content);
    const uint64_t more = varint_size(size) - 1;
    if (more != 0) {
      if (!room(out, more)) return full();
      std::memmove(content + more, content, static_cast<size_t>(size));
    }
    put_varint(content - 1, size);
    return out + more;
  }

  At delimited(const Operation& op, At out, Text content) {
    if ((out = begin_delimited(op, out, content.size)) == nullptr) return full();
    copy(out, content.data, content.size);
    return out + content.size;
  }

  const Lengths& lengths_;
  uint64_t place_;
  uint8_t* const end_;
};

using ProtobufWriter = ProtobufOutput<true>;
using ProtobufAppender = ProtobufOutput<false>;

}  // namespace
}  // namespace rosidl_proto
