// Protobuf (https://protobuf.dev/programming-guides/encoding/) to little-endian plain CDR.
//
// Protobuf fields come in any order, CDR wants the order of declaration. So each message is indexed first:
// one slot for each field says where its value is. Only the index of the outermost message is kept between
// the two steps, the others are made again: that is cheap, it needs no memory that grows with the input, and
// messages of fixed size are not looked into while measuring.
//
// The rules of the protobuf specification that are hidden in the details: the last value of a field wins; a
// field that is there several times is, for a submessage, all its pieces joined, and for a repeated field,
// all its elements; repeated numbers may be packed or not, whatever the schema says; a field whose wire type
// does not fit is unknown; unknown fields are skipped. Groups are refused: proto3 has none.
#include <cstdlib>
#include <limits>

#include "bytes.hpp"
#include "text.hpp"
#include "transcode.hpp"

namespace rosidl_proto {

Fields::Fields(const Plan& plan) {
  const uint64_t count = plan.root().slots;
  if (count <= kFew) return;
  const bool possible = count <= std::numeric_limits<size_t>::max() / sizeof(Slot);
  slots_ = more_ =
      possible ? static_cast<Slot*>(std::malloc(static_cast<size_t>(count) * sizeof(Slot))) : nullptr;
}

namespace {

constexpr uint8_t kHeader[4] = {0x00, 0x01, 0x00, 0x00};  // CDR_LE, no options

struct Range {
  const uint8_t* begin;
  const uint8_t* end;
};

using Slot = Fields::Slot;

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

// Both steps: finding the fields of a message. Positions are those of the message that was given, except
// inside of joined pieces, where errors name the place of the first piece.
class Index {
 public:
  Index(const Plan& plan, Input proto, Error& error)
      : plan_(plan), origin_(proto.data), origin_end_(proto.data + proto.size), error_(error) {}

 protected:
  bool fail(Reason reason, const uint8_t* p, uint64_t a = 0, uint64_t b = 0) {
    error_.reason = reason;
    error_.offset = offset(p);
    error_.a = a;
    error_.b = b;
    return false;
  }

  // A field that is not there has no place: then the error names that of its message.
  uint64_t offset(const uint8_t* p) const {
    const auto at = reinterpret_cast<uintptr_t>(p);
    const auto begin = reinterpret_cast<uintptr_t>(origin_), end = reinterpret_cast<uintptr_t>(origin_end_);
    return at >= begin && at <= end && p != nullptr ? at - begin : anchor_;
  }

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

  // Reads any tag. `*op` is nullptr for an unknown field.
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
    if (*wire_type == WireType::GroupStart || *wire_type == WireType::GroupEnd) {
      return fail(Reason::WireGroup, p, number), nullptr;
    }
    *op = plan_.find(message, static_cast<uint32_t>(number));
    return after;
  }

  // Reads a value. A number goes to `*value`; of a delimited value its size, and `*data` is its place.
  const uint8_t* value(const uint8_t* p, const uint8_t* end, WireType wire_type, const uint8_t** data,
                       uint64_t* value) {
    *data = p;
    uint64_t size;
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
      default: {
        const uint8_t* const after = get_varint(p, end, &size);
        if (after == nullptr) return fail(Reason::WireVarint, p), nullptr;
        *data = p = after;
        *value = size;
      }
    }
    if (left(p, end) < size) return fail(Reason::WireTruncated, p, size, left(p, end)), nullptr;
    return p + size;
  }

  // Whether a field with this wire type is the one that the schema means.
  static bool fits(const Operation& op, WireType wire_type) {
    return wire_type == op.wire_type || (op.packable && wire_type == WireType::Delimited);
  }

  bool leave(const Operation& op) {
    error_.leave(static_cast<uint32_t>(&op - &plan_.operation(0)));
    return false;
  }

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

  // Calls `visit(data, value, packed)` for each occurrence of a field, in order.
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
      if (!visit(data, number, wire_type == WireType::Delimited)) {
        error_.element = op.shape == Shape::Single || op.packable ? error_.element : seen;
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
      *range = {origin_, origin_};
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
    const bool good = occurrences(message, op, slot, end, [&](const uint8_t* data, uint64_t piece, bool) {
      if (piece > capacity - size) return fail(Reason::Changed, data);
      copy(pieces + size, data, piece);
      size += piece;
      return true;
    });
    *range = {pieces, pieces + size};
    return good;
  }

  bool array_length(const Operation& op, const Slot& slot, uint64_t elements) {
    // No element at all is the default of proto3, which stands for zeros.
    if (op.shape == Shape::Array && elements != op.count && elements != 0) {
      return fail(Reason::ArrayLength, slot.first, elements, op.count);
    }
    if (op.shape == Shape::Sequence && elements > op.count) {
      return fail(Reason::SequenceBound, slot.first, elements, op.count);
    }
    return true;
  }

  // The number of elements that an array or sequence has in protobuf.
  static uint64_t elements_of(const Operation& op, const Slot& slot) {
    switch (op.kind) {
      case Kind::Uint8:
      case Kind::Int8:
      case Kind::Char:
        return slot.value;
      case Kind::Wchar:
        return utf16_units(slot.data, slot.value);
      default:
        return op.packable ? slot.elements : slot.occurrences;
    }
  }

  // The place that errors name for a message whose bytes are not where they came from, or not there at all.
  class Anchor {
   public:
    Anchor(Index& index, const Slot& slot) : index_(index), before_(index.anchor_) {
      if (slot.first != nullptr) index.anchor_ = index.offset(slot.first);
    }
    Anchor(const Anchor&) = delete;
    Anchor& operator=(const Anchor&) = delete;
    ~Anchor() { index_.anchor_ = before_; }

   private:
    Index& index_;
    const uint64_t before_;
  };

  const Plan& plan_;
  const uint8_t* const origin_;
  const uint8_t* const origin_end_;
  Error& error_;
  uint64_t anchor_ = 0;
};

// Finds the size. A position counts from after the header.
class Measure : Index {
 public:
  Measure(const Plan& plan, Input proto, uint64_t limit, Error& error)
      : Index(plan, proto, error), limit_(limit) {}

  bool run(Fields& fields, uint64_t* size) {
    uint64_t position = 0;
    if (!message(plan_.root(), {origin_, origin_end_}, fields.slots(), &position)) return false;
    fields.message = plan_.root().fixed || origin_ == origin_end_ ? nullptr : origin_;
    *size = sizeof kHeader + position;
    return within_limit(position);
  }

 private:
  bool within_limit(uint64_t position) {
    return position + sizeof kHeader <= limit_ || fail(Reason::TooLarge, nullptr, limit_);
  }

  bool message(const Message& message, Range range, Slot* slots, uint64_t* position) {
    if (message.fixed || range.begin == range.end) {
      *position += message.default_size[*position & 7];
      return true;
    }
    if (!index(message, range, slots)) return false;
    uint64_t at = *position;
    const Operation* const last = plan_.end(message);
    for (const Operation* op = plan_.begin(message); op != last; ++op) {
      const Slot& slot = slots[op - plan_.begin(message)];
      const bool good = op->shape == Shape::Single
                            ? one(message, *op, slot, range.end, slots + message.count, &at)
                            : many(message, *op, slot, range.end, slots + message.count, &at);
      if (!good) return leave(*op);
    }
    *position = at;
    return true;
  }

  static void number(uint64_t size, uint64_t* at) { *at = align(*at, size) + size; }

  static void numbers(uint64_t size, uint64_t count, uint64_t* at) {
    if (count != 0) *at = align(*at, size) + size * count;
  }

  bool string(const Operation& op, const uint8_t* data, uint64_t size, uint64_t* at) {
    if (size > op.string_bound) {
      const uint64_t characters = utf8_code_points(data, size);
      if (characters > op.string_bound) return fail(Reason::StringBound, data, characters, op.string_bound);
    }
    *at = align(*at, 4) + 4 + size + 1;
    return within_limit(*at);
  }

  bool wstring(const uint8_t* data, uint64_t size, uint64_t* at) {
    if (size % 2 != 0) return fail(Reason::OddWstring, data, size);
    *at = align(*at, 4) + 4 + size * 2;
    return within_limit(*at);
  }

  bool one(const Message& parent, const Operation& op, const Slot& slot, const uint8_t* end, Slot* free,
           uint64_t* at) {
    switch (op.kind) {
      case Kind::Placeholder:
      case Kind::Bool:
      case Kind::Uint8:
      case Kind::Int8:
      case Kind::Char:
        *at += 1;
        return true;
      case Kind::Uint16:
      case Kind::Int16:
      case Kind::Wchar:
        number(2, at);
        return true;
      case Kind::Fixed32:
        number(4, at);
        return true;
      case Kind::Fixed64:
        number(8, at);
        return true;
      case Kind::String:
        return string(op, slot.data, slot.value, at);
      case Kind::Wstring:
        return wstring(slot.data, slot.value, at);
      case Kind::Message: {
        const Message& part = plan_.message(op.message);
        if (part.fixed) {
          *at += part.default_size[*at & 7];
          return true;
        }
        Joined joined;
        Range range;
        if (!submessage(parent, op, slot, end, joined, &range)) return false;
        const Anchor anchor(*this, slot);
        return message(part, range, free, at) && within_limit(*at);
      }
    }
    return fail(Reason::Changed, slot.first);
  }

  bool many(const Message& parent, const Operation& op, const Slot& slot, const uint8_t* end, Slot* free,
            uint64_t* at) {
    const uint64_t elements = elements_of(op, slot);
    if (!array_length(op, slot, elements)) return false;
    if (op.shape == Shape::Sequence) number(4, at);
    const uint64_t count = op.shape == Shape::Array ? op.count : elements;
    switch (op.kind) {
      case Kind::Bool:
      case Kind::Uint8:
      case Kind::Int8:
      case Kind::Char:
        *at += count;
        break;
      case Kind::Uint16:
      case Kind::Int16:
      case Kind::Wchar:
        numbers(2, count, at);
        break;
      case Kind::Fixed32:
        numbers(4, count, at);
        break;
      case Kind::Fixed64:
        numbers(8, count, at);
        break;
      case Kind::String:
        if (slot.occurrences == 0) return defaults(op, count, at);
        return occurrences(parent, op, slot, end, [&](const uint8_t* data, uint64_t size, bool) {
          return string(op, data, size, at);
        });
      case Kind::Wstring:
        if (slot.occurrences == 0) return defaults(op, count, at);
        return occurrences(parent, op, slot, end,
                           [&](const uint8_t* data, uint64_t size, bool) { return wstring(data, size, at); });
      case Kind::Message: {
        const Anchor anchor(*this, slot);
        const Message& part = plan_.message(op.message);
        if (slot.occurrences == 0 || part.fixed) return defaults(op, count, at);
        return occurrences(parent, op, slot, end, [&](const uint8_t* data, uint64_t size, bool) {
          return message(part, {data, data + size}, free, at) && within_limit(*at);
        });
      }
      case Kind::Placeholder:
        break;
    }
    return within_limit(*at);
  }

  // Elements that have the size of their default. The count is that of an array, which the plan bounds
  // together with the size of its elements, or that of occurrences in the input.
  bool defaults(const Operation& op, uint64_t count, uint64_t* at) {
    for (uint64_t i = 0; i < count; ++i) {
      switch (op.kind) {
        case Kind::String:
          *at = align(*at, 4) + 4 + 1;
          break;
        case Kind::Wstring:
          *at = align(*at, 4) + 4;
          break;
        default:
          *at += plan_.message(op.message).default_size[*at & 7];
      }
      if (*at + sizeof kHeader > limit_) break;
    }
    return within_limit(*at);
  }

  const uint64_t limit_;
};

class Write : Index {
 public:
  Write(const Plan& plan, Input proto, Output cdr, Error& error)
      : Index(plan, proto, error), out_origin_(cdr.data + sizeof kHeader), out_end_(cdr.data + cdr.size) {}

  bool run(Fields& fields) {
    const Range range = {origin_, origin_end_};
    const bool indexed = fields.message != nullptr && fields.message == origin_;
    fields.message = nullptr;
    uint8_t* const out = indexed ? indexed_message(plan_.root(), range, fields.slots(), out_origin_)
                                 : message(plan_.root(), range, fields.slots(), out_origin_);
    return out != nullptr && (out == out_end_ || fail(Reason::Changed, origin_end_));
  }

 private:
  // The functions below return the place after what they wrote; nullptr after an error.

  uint8_t* failed(Reason reason, const uint8_t* p, uint64_t a = 0, uint64_t b = 0) {
    fail(reason, p, a, b);
    return nullptr;
  }

  // Fills with zeros up to the alignment of numbers of `alignment` bytes; there is room for `size` bytes
  // after it.
  uint8_t* make_room(uint8_t* out, uint64_t alignment, uint64_t size) {
    const uint64_t padding = (0 - static_cast<uint64_t>(out - out_origin_)) & (alignment - 1);
    if (left(out, out_end_) < padding + size) return failed(Reason::Changed, nullptr);
    for (uint64_t i = 0; i < padding; ++i) *out++ = 0;
    return out;
  }

  template <class T>
  uint8_t* number(uint8_t* out, T value) {
    if ((out = make_room(out, sizeof(T), sizeof(T))) == nullptr) return nullptr;
    store_little(out, value);
    return out + sizeof(T);
  }

  uint8_t* zeros(uint8_t* out, uint64_t alignment, uint64_t size) {
    if (size == 0) return out;
    if ((out = make_room(out, alignment, size)) == nullptr) return nullptr;
    std::memset(out, 0, static_cast<size_t>(size));
    return out + size;
  }

  uint8_t* message(const Message& message, Range range, Slot* slots, uint8_t* out) {
    if (message.fixed) {
      const unsigned start = static_cast<unsigned>(out - out_origin_) & 7;
      uint8_t* const after = zeros(out, 1, message.default_size[start]);
      if (after == nullptr || place(message, range, start, out)) return after;
    }
    return index(message, range, slots) ? indexed_message(message, range, slots, out) : nullptr;
  }

  uint8_t* indexed_message(const Message& message, Range range, Slot* slots, uint8_t* out) {
    const Operation* const last = plan_.end(message);
    for (const Operation* op = plan_.begin(message); op != last; ++op) {
      const Slot& slot = slots[op - plan_.begin(message)];
      out = op->shape == Shape::Single ? one(message, *op, slot, range.end, slots + message.count, out)
                                       : many(message, *op, slot, range.end, slots + message.count, out);
      if (out == nullptr) return leave(*op), nullptr;
    }
    return out;
  }

  // Writes a message of fixed size over its default, each field to its place as it comes. This is a shortcut
  // for what serializers write, and needs no index: it returns false for everything else (a field that is
  // there twice, an array in pieces or of rare elements, a number that does not fit, anything wrong), which
  // is left to the general way.
  bool place(const Message& message, Range range, unsigned start, uint8_t* out) {
    const Operation* const first = plan_.begin(message);
    const Operation* by_declaration = first;
    const Operation* by_number = &plan_.operation(message.lowest);
    uint64_t seen = 0;
    if (message.count > 64) return false;
    for (const uint8_t* p = range.begin; p != range.end;) {
      const uint8_t* const tag_place = p;
      const Operation* op;
      WireType wire_type;
      p = likely_tag(tag_place, range.end, by_number, by_declaration, &op, &wire_type);
      if (p == nullptr && (p = tag(message, tag_place, range.end, &op, &wire_type)) == nullptr) return false;
      const uint8_t* data;
      uint64_t number = 0;
      if ((p = value(p, range.end, wire_type, &data, &number)) == nullptr) return false;
      if (op == nullptr || !fits(*op, wire_type)) continue;
      by_number = &plan_.operation(op->next);
      by_declaration = op + 1 == plan_.end(message) ? first : op + 1;
      const uint64_t bit = uint64_t{1} << (op - first);
      if ((seen & bit) != 0) return false;
      seen |= bit;
      uint8_t* const to = out + op->place[start];
      const bool good = op->shape == Shape::Single
                            ? place_one(*op, data, number, (start + op->place[start]) & 7, to)
                            : place_many(*op, wire_type, data, number, to);
      if (!good) return false;
    }
    return true;
  }

  bool place_one(const Operation& op, const uint8_t* data, uint64_t value, unsigned start, uint8_t* out) {
    switch (op.kind) {
      case Kind::Fixed32:
        store_little(out, static_cast<uint32_t>(value));
        return true;
      case Kind::Fixed64:
        store_little(out, value);
        return true;
      case Kind::Bool:
        *out = value != 0;
        return true;
      case Kind::Uint8:
      case Kind::Char:
        *out = static_cast<uint8_t>(value);
        return value <= 0xff;
      case Kind::Uint16:
      case Kind::Wchar:
        store_little(out, static_cast<uint16_t>(value));
        return value <= 0xffff;
      case Kind::Message:
        return place(plan_.message(op.message), {data, data + value}, start, out);
      default:
        return false;
    }
  }

  static bool place_many(const Operation& op, WireType wire_type, const uint8_t* data, uint64_t size,
                         uint8_t* out) {
    const uint64_t width = op.kind == Kind::Fixed64   ? 8
                           : op.kind == Kind::Fixed32 ? 4
                           : op.kind == Kind::Uint8   ? 1
                                                      : 0;
    if (wire_type != WireType::Delimited || size != op.count * width) return false;
    copy(out, data, size);
    return true;
  }

  // Numbers of 8 and 16 bits come as varints, which protobuf cuts to 32 bits before it looks at them.
  template <class T>
  bool narrow(uint64_t value, const uint8_t* p, T* result) {
    constexpr bool kSigned = std::numeric_limits<T>::is_signed;
    constexpr Reason kReason = sizeof(T) == 1 ? (kSigned ? Reason::NotInt8 : Reason::NotUint8)
                                              : (kSigned ? Reason::NotInt16 : Reason::NotUint16);
    const auto cut = static_cast<uint32_t>(value);
    const int64_t number = kSigned ? int64_t{static_cast<int32_t>(cut)} : int64_t{cut};
    if (number < std::numeric_limits<T>::min() || number > std::numeric_limits<T>::max()) {
      return fail(kReason, p, static_cast<uint64_t>(number));
    }
    *result = static_cast<T>(number);
    return true;
  }

  template <class T>
  uint8_t* narrowed(uint64_t value, const uint8_t* p, uint8_t* out) {
    T result;
    return narrow(value, p, &result) ? number(out, result) : nullptr;
  }

  uint8_t* one(const Message& parent, const Operation& op, const Slot& slot, const uint8_t* end, Slot* free,
               uint8_t* out) {
    switch (op.kind) {
      case Kind::Placeholder:
        return number(out, uint8_t{0});
      case Kind::Bool:
        return number(out, uint8_t{slot.value != 0});
      case Kind::Uint8:
      case Kind::Char:
        return narrowed<uint8_t>(slot.value, slot.data, out);
      case Kind::Int8:
        return narrowed<int8_t>(slot.value, slot.data, out);
      case Kind::Uint16:
      case Kind::Wchar:
        return narrowed<uint16_t>(slot.value, slot.data, out);
      case Kind::Int16:
        return narrowed<int16_t>(slot.value, slot.data, out);
      case Kind::Fixed32:
        return number(out, static_cast<uint32_t>(slot.value));
      case Kind::Fixed64:
        return number(out, slot.value);
      case Kind::String:
        return string(slot.data, slot.value, out);
      case Kind::Wstring:
        return wstring(op, slot.data, slot.value, out);
      case Kind::Message: {
        Joined joined;
        Range range;
        if (!submessage(parent, op, slot, end, joined, &range)) return nullptr;
        const Anchor anchor(*this, slot);
        return message(plan_.message(op.message), range, free, out);
      }
    }
    return failed(Reason::Changed, slot.first);
  }

  uint8_t* many(const Message& parent, const Operation& op, const Slot& slot, const uint8_t* end, Slot* free,
                uint8_t* out) {
    const uint64_t elements = elements_of(op, slot);
    if (!array_length(op, slot, elements)) return nullptr;
    if (op.shape == Shape::Sequence && (out = number(out, static_cast<uint32_t>(elements))) == nullptr)
      return nullptr;
    const bool absent = elements == 0;
    switch (op.kind) {
      case Kind::Uint8:
      case Kind::Int8:
        return absent ? absent_numbers(op, 1, out) : copied(slot.data, elements, 1, out);
      case Kind::Char:
        if (absent) return absent_numbers(op, 1, out);
        if (!is_utf8(slot.data, elements)) return failed(Reason::Utf8, slot.data);
        return copied(slot.data, elements, 1, out);
      case Kind::Wchar:
        return absent ? absent_numbers(op, 2, out) : wide_text(slot, elements, out);
      case Kind::Fixed32:
        return absent ? absent_numbers(op, 4, out) : fixed<uint32_t>(parent, op, slot, end, out);
      case Kind::Fixed64:
        return absent ? absent_numbers(op, 8, out) : fixed<uint64_t>(parent, op, slot, end, out);
      case Kind::Bool:
        return absent ? absent_numbers(op, 1, out)
                      : varints<uint8_t>(parent, op, slot, end, out,
                                         [](uint64_t value, const uint8_t*, uint8_t* result) {
                                           *result = value != 0;
                                           return true;
                                         });
      case Kind::Uint16:
        return absent ? absent_numbers(op, 2, out) : narrow_varints<uint16_t>(parent, op, slot, end, out);
      case Kind::Int16:
        return absent ? absent_numbers(op, 2, out) : narrow_varints<int16_t>(parent, op, slot, end, out);
      default:
        break;
    }
    if (absent && op.shape == Shape::Array) return absent_elements(op, free, out);
    if (absent) return out;
    const Anchor anchor(*this, slot);
    const bool good = occurrences(parent, op, slot, end, [&](const uint8_t* data, uint64_t size, bool) {
      out = op.kind == Kind::String    ? string(data, size, out)
            : op.kind == Kind::Wstring ? wstring(op, data, size, out)
                                       : message(plan_.message(op.message), {data, data + size}, free, out);
      return out != nullptr;
    });
    return good ? out : nullptr;
  }

  uint8_t* absent_numbers(const Operation& op, uint64_t size, uint8_t* out) {
    return op.shape == Shape::Array ? zeros(out, size, size * op.count) : out;
  }

  uint8_t* absent_elements(const Operation& op, Slot* free, uint8_t* out) {
    for (uint32_t i = 0; i < op.count && out != nullptr; ++i) {
      out = op.kind == Kind::String    ? string(nullptr, 0, out)
            : op.kind == Kind::Wstring ? wstring(op, nullptr, 0, out)
                                       : message(plan_.message(op.message), {origin_, origin_}, free, out);
    }
    return out;
  }

  uint8_t* copied(const uint8_t* data, uint64_t size, uint64_t alignment, uint8_t* out) {
    if ((out = make_room(out, alignment, size)) == nullptr) return nullptr;
    copy(out, data, size);
    return out + size;
  }

  uint8_t* string(const uint8_t* data, uint64_t size, uint8_t* out) {
    if (!is_utf8(data, size)) return failed(Reason::Utf8, data);
    // CORBA 3.3 part 2, section 9.3.2.7: the only NUL is the last byte. rclpy and rclc read no further than
    // the first.
    if (size != 0 && std::memchr(data, 0, static_cast<size_t>(size)) != nullptr)
      return failed(Reason::NulInString, data);
    if ((out = make_room(out, 4, 4 + size + 1)) == nullptr) return nullptr;
    store_little(out, static_cast<uint32_t>(size + 1));
    copy(out + 4, data, size);
    out[4 + size] = 0;
    return out + 4 + size + 1;
  }

  uint8_t* wstring(const Operation& op, const uint8_t* data, uint64_t size, uint8_t* out) {
    const uint64_t units = size / 2;
    if ((out = make_room(out, 4, 4 + units * 4)) == nullptr) return nullptr;
    store_little(out, static_cast<uint32_t>(units));
    out += 4;
    uint64_t pairs = 0;
    bool after_high = false;
    for (uint64_t i = 0; i < units; ++i, out += 4) {
      const auto unit = load_little<uint16_t>(data + i * 2);
      if (after_high != is_low_surrogate(unit)) return failed(Reason::Utf16, data + i * 2);
      after_high = is_high_surrogate(unit);
      pairs += after_high;
      store_little(out, uint32_t{unit});
    }
    if (after_high) return failed(Reason::Utf16, data + (units - 1) * 2);
    if (units - pairs > op.string_bound)
      return failed(Reason::StringBound, data, units - pairs, op.string_bound);
    return out;
  }

  uint8_t* wide_text(const Slot& slot, uint64_t units, uint8_t* out) {
    if ((out = make_room(out, 2, units * 2)) == nullptr) return nullptr;
    const uint8_t* const out_last = out + units * 2;
    const uint8_t* const end = slot.data + slot.value;
    for (const uint8_t* p = slot.data; p != end;) {
      uint32_t code_point;
      const uint8_t* const after = next_code_point(p, end, &code_point);
      if (after == nullptr) return failed(Reason::Utf8, p);
      p = after;
      const uint64_t size = code_point < 0x10000 ? 2 : 4;
      if (left(out, out_last) < size) return failed(Reason::Changed, p);
      if (size == 4) {
        store_little(out, static_cast<uint16_t>(0xd800 + ((code_point - 0x10000) >> 10)));
        code_point = 0xdc00 | (code_point & 0x3ff);
        out += 2;
      }
      store_little(out, static_cast<uint16_t>(code_point));
      out += 2;
    }
    return out == out_last ? out : failed(Reason::Changed, end);
  }

  template <class T>
  uint8_t* fixed(const Message& parent, const Operation& op, const Slot& slot, const uint8_t* end,
                 uint8_t* out) {
    if (slot.occurrences == 1 && slot.delimited) return copied(slot.data, slot.value, sizeof(T), out);
    if ((out = make_room(out, sizeof(T), uint64_t{slot.elements} * sizeof(T))) == nullptr) return nullptr;
    const uint8_t* const out_last = out + uint64_t{slot.elements} * sizeof(T);
    const bool good =
        occurrences(parent, op, slot, end, [&](const uint8_t* data, uint64_t value, bool packed) {
          const uint64_t size = packed ? value : sizeof(T);
          if (left(out, out_last) < size) return fail(Reason::Changed, data);
          copy(out, data, size);
          out += size;
          return true;
        });
    return good && (out == out_last || fail(Reason::Changed, slot.first)) ? out : nullptr;
  }

  template <class T>
  uint8_t* narrow_varints(const Message& parent, const Operation& op, const Slot& slot, const uint8_t* end,
                          uint8_t* out) {
    return varints<T>(parent, op, slot, end, out, [this](uint64_t value, const uint8_t* p, T* result) {
      return narrow(value, p, result);
    });
  }

  template <class T, class Convert>
  uint8_t* varints(const Message& parent, const Operation& op, const Slot& slot, const uint8_t* end,
                   uint8_t* out, Convert convert) {
    if ((out = make_room(out, sizeof(T), uint64_t{slot.elements} * sizeof(T))) == nullptr) return nullptr;
    uint32_t i = 0;
    const auto put = [&](uint64_t value, const uint8_t* p) {
      T result;
      if (i == slot.elements) return fail(Reason::Changed, p);
      if (!convert(value, p, &result)) {
        error_.element = i;
        return false;
      }
      store_little(out + uint64_t{i++} * sizeof(T), result);
      return true;
    };
    const bool good =
        occurrences(parent, op, slot, end, [&](const uint8_t* data, uint64_t value, bool packed) {
          if (!packed) return put(value, data);
          for (const uint8_t *p = data, *const last = data + value; p != last;) {
            uint64_t element;
            const uint8_t* const after = get_varint(p, last, &element);
            if (after == nullptr) return fail(Reason::WireVarint, p);
            if (!put(element, p)) return false;
            p = after;
          }
          return true;
        });
    if (!good || (i != slot.elements && !fail(Reason::Changed, slot.first))) return nullptr;
    return out + uint64_t{i} * sizeof(T);
  }

  uint8_t* const out_origin_;
  uint8_t* const out_end_;
};

}  // namespace

bool measure_proto_to_cdr(const Plan& plan, Input proto, uint64_t limit, Fields& fields, uint64_t* size,
                          Error& error) noexcept {
  fields.message = nullptr;
  if (proto.size > kMaximumSize) {
    error.reason = Reason::WireSize;
    error.a = proto.size;
    return false;
  }
  if (fields.slots() == nullptr) {
    error.reason = Reason::OutOfMemory;
    return false;
  }
  if (limit > kMaximumSize) limit = kMaximumSize;
  return Measure(plan, proto, limit, error).run(fields, size);
}

bool write_proto_to_cdr(const Plan& plan, Input proto, Fields& fields, Output cdr, Error& error) noexcept {
  if (fields.slots() == nullptr) {
    error.reason = Reason::OutOfMemory;
    return false;
  }
  if (cdr.size < sizeof kHeader) {
    error.reason = Reason::Changed;
    return false;
  }
  copy(cdr.data, kHeader, sizeof kHeader);
  return Write(plan, proto, cdr, error).run(fields);
}

}  // namespace rosidl_proto
