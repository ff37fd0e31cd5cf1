// The protobuf wire format (https://protobuf.dev/programming-guides/encoding/): reads that check before they
// read.
//
// Positions are those of the message that was given, except inside of pieces that were joined, where errors
// name the place of the first piece.
#pragma once

#include <cstdlib>
#include <limits>

#include "rosidl_adapter_proto/error.hpp"
#include "rosidl_adapter_proto/transcode.hpp"
#include "rosidl_adapter_proto/wire.hpp"

namespace rosidl_proto {
namespace {

struct Range {
  const uint8_t* begin;
  const uint8_t* end;
};

// Memory for pieces of a submessage that have to be joined; freed with its message.
class Joined {
 public:
  Joined() = default;
  Joined(const Joined&) = delete;
  Joined& operator=(const Joined&) = delete;
  ~Joined() { std::free(data_); }

  uint8_t* allocate(uint64_t size) {
    if (size >= std::numeric_limits<size_t>::max()) return nullptr;
    return data_ = static_cast<uint8_t*>(std::malloc(static_cast<size_t>(size) + 1));
  }

 private:
  uint8_t* data_ = nullptr;
};

class ProtobufInput {
 public:
  using Slot = Fields::Slot;

  ProtobufInput(const Plan& plan, Input proto, Error& error)
      : plan_(plan), origin_(proto.data), origin_end_(proto.data + proto.size), error_(error) {}

  Range whole() const { return {origin_, origin_end_}; }
  Range nothing() const { return {origin_, origin_}; }

  bool fail(Reason reason, const uint8_t* p, uint64_t a = 0, uint64_t b = 0) {
    error_.reason = reason;
    error_.offset = offset(p);
    error_.a = a;
    error_.b = b;
    return false;
  }

  bool leave(const Operation& op) {
    error_.leave(static_cast<uint32_t>(&op - &plan_.operation(0)));
    return false;
  }

  void at_element(int64_t element) { error_.element = element; }

  static uint64_t left(const uint8_t* p, const uint8_t* end) { return static_cast<uint64_t>(end - p); }

  // Reads a tag when it is one of two that are likely to come; nullptr if it is neither.
  const uint8_t* likely_tag(const uint8_t* p, const uint8_t* end, const Operation* by_number,
                            const Operation* by_declaration, const Operation** op,
                            WireType* wire_type) const {
    if (left(p, end) < 8) return nullptr;
    const uint64_t word = load_little<uint64_t>(p);
    for (const Operation* guess : {by_number, by_declaration}) {
      if ((word & guess->tag_mask) != guess->tag) continue;
      *op = guess;
      *wire_type = guess->packable ? WireType::Delimited : guess->wire_type;
      return p + guess->tag_size;
    }
    return nullptr;
  }

  // Reads any tag. `*op` is nullptr for an unknown field, which a group always is.
  const uint8_t* tag(const Message& message, const uint8_t* p, const uint8_t* end, const Operation** op,
                     WireType* wire_type) {
    uint64_t value;
    const uint8_t* const after = get_varint(p, end, &value);
    if (after == nullptr) return fail(Reason::WireVarint, p), nullptr;
    const uint64_t number = value >> 3, type = value & 7;
    // A tag is a uint32; field numbers begin with 1.
    if (value > 0xffffffff || number == 0) return fail(Reason::WireTag, p, number), nullptr;
    if (type > 5) return fail(Reason::WireType, p, number, type), nullptr;
    *wire_type = static_cast<WireType>(type);
    *op = nullptr;
    if (*wire_type == WireType::GroupEnd) return fail(Reason::WireGroup, p, number), nullptr;
    if (*wire_type == WireType::GroupStart) {
      group_ = number;
    } else {
      *op = plan_.find(message, static_cast<uint32_t>(number));
    }
    return after;
  }

  // Reads a value. A number goes to `*value`; of a delimited value its size, and `*data` is its place.
  const uint8_t* value(const uint8_t* p, const uint8_t* end, WireType wire_type, const uint8_t** data,
                       uint64_t* value) {
    *data = p;
    uint64_t size = 0;
    switch (wire_type) {
      case WireType::Fixed64:
        size = 8;
        if (left(p, end) >= size) *value = load_little<uint64_t>(p);
        break;
      case WireType::Fixed32:
        size = 4;
        if (left(p, end) >= size) *value = load_little<uint32_t>(p);
        break;
      case WireType::Varint: {
        const uint8_t* const after = get_varint(p, end, value);
        if (after == nullptr) fail(Reason::WireVarint, p);
        return after;
      }
      case WireType::GroupStart:
        return rest_of_group(p, end);
      case WireType::Delimited:
      case WireType::GroupEnd: {  // `tag` lets none through
        const uint8_t* const after = get_varint(p, end, &size);
        if (after == nullptr) return fail(Reason::WireVarint, p), nullptr;
        *data = p = after;
        *value = size;
        break;
      }
    }
    if (left(p, end) < size) return fail(Reason::WireTruncated, p, size, left(p, end)), nullptr;
    return p + size;
  }

  // Whether a field with this wire type is the one that the schema means.
  static bool fits(const Operation& op, WireType wire_type) {
    return wire_type == op.wire_type || (op.packable && wire_type == WireType::Delimited);
  }

  // Fills in one slot for each operation of the message.
  bool index(const Message& message, Range range, Slot* slots) {
    std::memset(static_cast<void*>(slots), 0, message.count * sizeof(Slot));
    // Serializers write fields in the order of their numbers, and this project in that of their declaration:
    // so the next field is nearly always one of two, whose tags can be compared instead of decoded.
    const Operation* const first = plan_.begin(message);
    const Operation* by_declaration = first;
    const Operation* by_number = &plan_.operation(message.lowest);
    for (const uint8_t* p = range.begin; p != range.end;) {
      const uint8_t* const start = p;
      const Operation* op;
      WireType wire_type;
      p = likely_tag(start, range.end, by_number, by_declaration, &op, &wire_type);
      if (p == nullptr && (p = tag(message, start, range.end, &op, &wire_type)) == nullptr) return false;
      const uint8_t* data;
      uint64_t number = 0;
      if ((p = value(p, range.end, wire_type, &data, &number)) == nullptr)
        return op == nullptr ? false : leave(*op);
      if (op == nullptr || !fits(*op, wire_type)) continue;
      by_number = &plan_.operation(op->next);
      by_declaration = op + 1 == plan_.end(message) ? first : op + 1;
      Slot& slot = slots[op - first];
      if (slot.occurrences++ == 0) slot.first = start;
      slot.data = data;
      slot.value = number;
      if (!op->packable) continue;
      slot.delimited = wire_type == WireType::Delimited;
      uint64_t elements = 1;
      if (slot.delimited && !packed_elements(*op, data, number, &elements)) return leave(*op);
      slot.elements += static_cast<uint32_t>(elements);
    }
    return true;
  }

  // Calls `visit(data, value, packed, element)` for each occurrence of a field, in order.
  template <class Visit>
  bool occurrences(const Message& message, const Operation& op, const Slot& slot, const uint8_t* end,
                   Visit visit) {
    const uint8_t* p = slot.first;
    for (uint32_t seen = 0; seen < slot.occurrences;) {
      const Operation* found = &op;
      WireType wire_type = WireType::Delimited;
      // Repeated values stand side by side, as a rule.
      if (op.wire_type == WireType::Delimited && left(p, end) >= 8 &&
          (load_little<uint64_t>(p) & op.tag_mask) == op.tag) {
        p += op.tag_size;
      } else {
        if (p == end) return fail(Reason::Changed, p);
        if ((p = tag(message, p, end, &found, &wire_type)) == nullptr) return false;
      }
      const uint8_t* data;
      uint64_t number = 0;
      if ((p = value(p, end, wire_type, &data, &number)) == nullptr) return false;
      if (found != &op || !fits(op, wire_type)) continue;
      if (!visit(data, number, wire_type == WireType::Delimited, seen)) {
        if (op.shape != Shape::Single && !op.packable) at_element(seen);
        return false;
      }
      ++seen;
    }
    return true;
  }

  // The bytes of a submessage. Joining its pieces is what the specification says about merging them.
  bool submessage(const Message& message, const Operation& op, const Slot& slot, const uint8_t* end,
                  Joined& joined, Range* range) {
    if (slot.occurrences == 0) {
      *range = nothing();
      return true;
    }
    if (slot.occurrences == 1) {
      *range = {slot.data, slot.data + slot.value};
      return true;
    }
    const uint8_t* const begin = slot.first;
    const uint64_t capacity = left(begin, end);
    uint8_t* const pieces = joined.allocate(capacity);
    if (pieces == nullptr) return fail(Reason::OutOfMemory, begin);
    uint64_t size = 0;
    const auto append = [&](const uint8_t* data, uint64_t piece, bool, uint32_t) {
      if (piece > capacity - size) return fail(Reason::Changed, data);
      copy(pieces + size, data, piece);
      size += piece;
      return true;
    };
    const bool good = occurrences(message, op, slot, end, append);
    *range = {pieces, pieces + size};
    return good;
  }

  // The place that errors name for a message whose bytes are not where they came from, or not there at all.
  class Anchor {
   public:
    Anchor(ProtobufInput& input, const Slot& slot) : input_(input), before_(input.anchor_) {
      if (slot.first != nullptr) input.anchor_ = input.offset(slot.first);
    }
    Anchor(const Anchor&) = delete;
    Anchor& operator=(const Anchor&) = delete;
    ~Anchor() { input_.anchor_ = before_; }

   private:
    ProtobufInput& input_;
    const uint64_t before_;
  };

 private:
  ROSIDL_PROTO_NO_INLINE const uint8_t* rest_of_group(const uint8_t* p, const uint8_t* end) {
    const uint8_t* const after = skip_group(p, end, group_);
    if (after == nullptr) fail(Reason::WireGroup, p, group_);
    return after;
  }

  // A field that is not there has no place: then the error names that of its message.
  uint64_t offset(const uint8_t* p) const {
    const auto at = reinterpret_cast<uintptr_t>(p);
    const auto begin = reinterpret_cast<uintptr_t>(origin_), end = reinterpret_cast<uintptr_t>(origin_end_);
    return at >= begin && at <= end && p != nullptr ? at - begin : anchor_;
  }

  bool packed_elements(const Operation& op, const uint8_t* data, uint64_t size, uint64_t* elements) {
    const uint64_t width = op.wire_type == WireType::Fixed64 ? 8 : op.wire_type == WireType::Fixed32 ? 4 : 1;
    if (size % width != 0) return fail(Reason::WirePacked, data, size, width);
    *elements = size / width;
    if (width != 1) return true;
    if (size != 0 && data[size - 1] >= 0x80) return fail(Reason::WireVarint, data);
    uint64_t count = 0;
    for (uint64_t i = 0; i < size; ++i) count += data[i] < 0x80;
    *elements = count;
    return true;
  }

  const Plan& plan_;
  const uint8_t* const origin_;
  const uint8_t* const origin_end_;
  Error& error_;
  uint64_t anchor_ = 0;
  uint64_t group_ = 0;  // the field number of the group whose beginning was read last
};

}  // namespace
}  // namespace rosidl_proto
