// Reads protobuf along a plan and drives a sink.
//
// Protobuf fields come in any order, sinks want the order of declaration. So each message is indexed first:
// one slot for each field says where its value is. Only the index of the outermost message is kept between
// measuring and writing, the others are made again: that is cheap, it needs no memory that grows with the
// input, and messages of fixed size are not looked into while measuring.
//
// The rules of the protobuf specification that are hidden in the details: the last value of a field wins; a
// field that is there several times is, for a submessage, all its pieces joined, and for a repeated field,
// all its elements; repeated numbers may be packed or not, whatever the schema says; a field whose wire type
// does not fit is unknown; unknown fields are skipped, and so are groups, which proto3 does not have.
#pragma once

#include "protobuf_input.hpp"
#include "sink.hpp"
#include "text.hpp"

namespace rosidl_proto {
namespace {

// Where a field is looked for: its message, the operation, its slot, and the end of the bytes of the message.
struct ProtobufField {
  const Message& message;
  const Operation& op;
  const Fields::Slot& slot;
  const uint8_t* end;
};

// The numbers of an array or sequence.
template <class F>
class ProtobufNumbers {
 public:
  using Raw = typename F::Raw;

  ProtobufNumbers(ProtobufInput& input, const ProtobufField& field, uint64_t found)
      : input_(input), field_(field), found_(found) {}

  uint64_t count() const { return absent() ? field_.op.count : found_; }
  // No element at all is the default of proto3, which stands for zeros.
  bool absent() const { return found_ == 0 && field_.op.shape == Shape::Array; }

  const uint8_t* bytes() const {
    const Fields::Slot& slot = field_.slot;
    const bool together = F::kIsOneValue || (slot.occurrences == 1 && slot.delimited);
    return F::kCopiesToCdr && together && !absent() ? slot.data : nullptr;
  }

  template <class Visit>
  bool each(Visit visit) const {
    if (absent()) return zeros(visit);
    if constexpr (F::kIsOneValue) {
      return F::kIsText && F::kSize != 1 ? each_unit(visit) : each_byte(visit);
    } else {
      uint64_t index = 0;
      const auto put = [&](uint64_t value, const uint8_t* p) {
        if (index == found_) return input_.fail(Reason::Changed, p);
        Raw raw{};
        if (!from_wire<F>(value, &raw)) {
          input_.fail(Reason::Range, p, value, static_cast<uint64_t>(field_.op.cdr));
          input_.at_element(static_cast<int64_t>(index));
          return false;
        }
        ++index;
        return visit(raw);
      };
      const auto occurrence = [&](const uint8_t* data, uint64_t value, bool packed, uint32_t) {
        return packed ? each_packed({data, data + value}, put) : put(value, data);
      };
      return input_.occurrences(field_.message, field_.op, field_.slot, field_.end, occurrence) &&
             (index == found_ || input_.fail(Reason::Changed, field_.slot.first));
    }
  }

 private:
  template <class Visit>
  bool zeros(Visit visit) const {
    for (uint64_t i = 0; i < field_.op.count; ++i) {
      if (!visit(Raw{0})) return false;
    }
    return true;
  }

  template <class Visit>
  bool each_byte(Visit visit) const {
    for (uint64_t i = 0; i < found_; ++i) {
      if (!visit(static_cast<Raw>(field_.slot.data[i]))) return false;
    }
    return true;
  }

  // Text as UTF-16 code units.
  template <class Visit>
  bool each_unit(Visit visit) const {
    const uint8_t* const end = field_.slot.data + field_.slot.value;
    for (const uint8_t* p = field_.slot.data; p != end;) {
      uint32_t code_point;
      const uint8_t* const after = next_code_point(p, end, &code_point);
      if (after == nullptr) return input_.fail(Reason::Utf8, p);
      p = after;
      if (code_point >= 0x10000) {
        if (!visit(static_cast<Raw>(0xd800 + ((code_point - 0x10000) >> 10)))) return false;
        code_point = 0xdc00 | (code_point & 0x3ff);
      }
      if (!visit(static_cast<Raw>(code_point))) return false;
    }
    return true;
  }

  template <class Put>
  bool each_packed(Range range, Put put) const {
    for (const uint8_t* p = range.begin; p != range.end;) {
      uint64_t value = 0;
      const uint8_t* const place = p;
      if constexpr (F::kWireType == WireType::Varint) {
        if ((p = get_varint(p, range.end, &value)) == nullptr) return input_.fail(Reason::WireVarint, place);
      } else {
        const uint8_t* data;
        if ((p = input_.value(p, range.end, F::kWireType, &data, &value)) == nullptr) return false;
      }
      if (!put(value, place)) return false;
    }
    return true;
  }

  ProtobufInput& input_;
  const ProtobufField& field_;
  const uint64_t found_;
};

// The code units of a wide string: UTF-16LE.
class ProtobufUnits {
 public:
  explicit ProtobufUnits(Text text) : text_(text) {}

  uint64_t count() const { return text_.size / 2; }
  uint32_t operator[](uint64_t index) const { return load_little<uint16_t>(place(index)); }
  const uint8_t* place(uint64_t index) const { return text_.data + index * 2; }

 private:
  Text text_;
};

// `kSizes` checks bounds and lengths, `kContent` what is text and which numbers fit: measuring and writing
// share the work.
template <bool kSizes, bool kContent, class Sink>
class ProtobufReader {
  using At = typename Sink::At;
  using Slot = Fields::Slot;

 public:
  ProtobufReader(const Plan& plan, Input proto, const Sink& sink, Error& error)
      : plan_(plan), input_(plan, proto, error), sink_(sink) {}

  // Reads the whole message, whose fields `slots` may already have.
  bool run(Slot* slots, bool indexed, At* at) {
    const Message& root = plan_.root();
    const At end =
        indexed ? fields(root, input_.whole(), slots, *at) : message(root, input_.whole(), slots, *at);
    if (Sink::failed(end)) return false;
    *at = end;
    return sink_.finish(end) || input_.fail(sink_.reason, nullptr, sink_.detail);
  }

 private:
  // An error that is already filled in.
  static At failed() { return Sink::failure(); }

  At fail(Reason reason, const uint8_t* p, uint64_t a = 0, uint64_t b = 0) {
    input_.fail(reason, p, a, b);
    return failed();
  }

  // Fills in the error if it was the sink that stopped.
  At take(At at) {
    if (Sink::failed(at) && sink_.reason != Reason::None) input_.fail(sink_.reason, nullptr, sink_.detail);
    return at;
  }

  At message(const Message& message, Range range, Slot* slots, At at) {
    if constexpr (Sink::kSizesOnly) {
      if (message.fixed || range.begin == range.end) return sink_.defaults(message, at, 1);
    }
    if constexpr (Sink::kPlaces) {
      if (message.fixed) {
        const unsigned start = static_cast<unsigned>(sink_.position(at) & 7);
        const At after = take(sink_.zeros(message, at));
        if (Sink::failed(after) || place(message, range, start, at)) return after;
      }
    }
    return input_.index(message, range, slots) ? fields(message, range, slots, at) : failed();
  }

  // The fields of a message that is indexed; `slots` behind its own are free.
  At fields(const Message& message, Range range, Slot* slots, At at) {
    const Operation* const last = plan_.end(message);
    Slot* const free = slots + message.count;
    for (const Operation* op = plan_.begin(message); op != last; ++op) {
      if (!Sink::kMakesCdr && op->reading == Reading::Skip) continue;
      const ProtobufField field{message, *op, slots[op - plan_.begin(message)], range.end};
      at = op->shape == Shape::Single ? one(field, free, at) : many(field, free, at);
      if (Sink::failed(at)) return input_.leave(*op), at;
    }
    return at;
  }

  ROSIDL_PROTO_INLINE At one(const ProtobufField& field, Slot* free, At at) {
    const Slot& slot = field.slot;
    return visit(field.op.cdr, [&](auto form) ROSIDL_PROTO_INLINE_LAMBDA -> At {
      using F = decltype(form);
      if constexpr (F::kIsNumber) {
        typename F::Raw raw{};
        if (kContent && !from_wire<F>(slot.value, &raw)) {
          return fail(Reason::Range, slot.data, slot.value, static_cast<uint64_t>(field.op.cdr));
        }
        return take(sink_.template number<F>(field.op, at, raw));
      } else if constexpr (F::kIsString) {
        return string<F>(field.op, at, kNoElement, {slot.data, slot.value});
      } else {
        const Message& part = plan_.message(field.op.message);
        if constexpr (Sink::kSizesOnly) {
          if (part.fixed) return sink_.defaults(part, at, 1);
        }
        Joined joined;
        Range range;
        if (!input_.submessage(field.message, field.op, slot, field.end, joined, &range)) return failed();
        const ProtobufInput::Anchor anchor(input_, slot);
        return submessage(field.op, range, free, at, kNoElement);
      }
    });
  }

  ROSIDL_PROTO_INLINE At many(const ProtobufField& field, Slot* free, At at) {
    return visit(field.op.cdr, [&](auto form) ROSIDL_PROTO_INLINE_LAMBDA -> At {
      using F = decltype(form);
      if constexpr (F::kIsNumber) {
        return numbers<F>(field, at);
      } else {
        return elements<F>(field, free, at);
      }
    });
  }

  template <class F>
  ROSIDL_PROTO_NO_INLINE At numbers(const ProtobufField& field, At at) {
    const Slot& slot = field.slot;
    uint64_t found = slot.elements;
    if constexpr (F::kIsOneValue) {
      static_assert(F::kIsText || F::kSize == 1, "bytes in protobuf are bytes in CDR");
      found = F::kSize == 1 ? slot.value : utf16_units(slot.data, slot.value);
    }
    if (!check_count(field, found)) return failed();
    if constexpr (kContent && !F::kTakesAll && F::kIsText) {
      for (uint64_t i = 0; i < slot.value; ++i) {
        if (!F::is_value(slot.data[i])) return not_a_character(field, i);
      }
    }
    return take(sink_.template numbers<F>(field.op, at, ProtobufNumbers<F>(input_, field, found)));
  }

  template <class F>
  ROSIDL_PROTO_NO_INLINE At elements(const ProtobufField& field, Slot* free, At at) {
    const uint32_t found = field.slot.occurrences;
    if (!check_count(field, found)) return failed();
    const bool absent = found == 0 && field.op.shape == Shape::Array;
    const uint32_t count = absent ? field.op.count : found;
    at = take(sink_.elements(field.op, at, count));
    if (Sink::failed(at)) return at;
    if constexpr (F::kIsString) {
      return each(field, absent, at, [&](Range range, At next, int64_t index) {
        return string<F>(field.op, next, index, {range.begin, ProtobufInput::left(range.begin, range.end)});
      });
    } else {
      const ProtobufInput::Anchor anchor(input_, field.slot);
      if constexpr (Sink::kSizesOnly) {
        const Message& part = plan_.message(field.op.message);
        if (absent || part.fixed) return take(sink_.within_limit(sink_.defaults(part, at, count)));
      }
      return each(field, absent, at, [&](Range range, At next, int64_t index) {
        return submessage(field.op, range, free, next, index);
      });
    }
  }

  // Calls `element(bytes, at, index)` for each occurrence of a field, or for an array that is absent.
  template <class Element>
  At each(const ProtobufField& field, bool absent, At at, Element element) {
    if (absent) {
      for (uint32_t i = 0; i < field.op.count && !Sink::failed(at); ++i) {
        at = element(input_.nothing(), at, i);
      }
      return at;
    }
    const auto occurrence = [&](const uint8_t* data, uint64_t size, bool, uint32_t index) {
      at = element(Range{data, data + size}, at, index);
      return !Sink::failed(at);
    };
    return input_.occurrences(field.message, field.op, field.slot, field.end, occurrence) ? at : failed();
  }

  bool check_count(const ProtobufField& field, uint64_t found) {
    const Operation& op = field.op;
    if (op.shape == Shape::Array && found != op.count && found != 0)
      return input_.fail(Reason::ArrayLength, field.slot.first, found, op.count);
    return op.shape != Shape::Sequence || found <= op.count ||
           input_.fail(Reason::SequenceBound, field.slot.first, found, op.count);
  }

  At submessage(const Operation& op, Range range, Slot* free, At at, int64_t element) {
    const auto nested = sink_.begin(op, at, element);
    if (Sink::failed(nested.at)) return take(nested.at);
    const At inner = message(plan_.message(op.message), range, free, nested.at);
    return Sink::failed(inner) ? inner : take(sink_.end(op, at, nested, inner));
  }

  ROSIDL_PROTO_NO_INLINE At not_a_character(const ProtobufField& field, uint64_t index) {
    const uint8_t* const p = field.slot.data + index;
    uint32_t code_point;
    if (next_code_point(p, field.slot.data + field.slot.value, &code_point) == nullptr)
      return fail(Reason::Utf8, p);
    input_.at_element(static_cast<int64_t>(index));
    return fail(Reason::Range, p, code_point, static_cast<uint64_t>(field.op.cdr));
  }

  // Strings
  // ----------------------------------------------------------------------------------------------------------

  template <class F>
  At string(const Operation& op, At at, int64_t element, Text text) {
    if constexpr (F::kIsBytes) {
      return take(sink_.bytes(op, at, element, text));
    } else if constexpr (F::kUnitSize == 1) {
      if (kSizes && text.size > op.string_bound &&
          !check_bound(op, text.data, utf8_code_points(text.data, text.size)))
        return failed();
      if (kContent && !Sink::kAnyText && !check_text(text)) return failed();
      return take(sink_.string(op, at, element, text));
    } else {
      if (kSizes && text.size % 2 != 0) return fail(Reason::OddWstring, text.data, text.size);
      const ProtobufUnits units(text);
      if (kSizes && units.count() > op.string_bound && !check_bound(op, text.data, utf16_characters(units)))
        return failed();
      return take(sink_.wstring(op, at, element, units));
    }
  }

  bool check_bound(const Operation& op, const uint8_t* p, uint64_t characters) {
    return characters <= op.string_bound || input_.fail(Reason::StringBound, p, characters, op.string_bound);
  }

  bool check_text(Text text) {
    if (!is_utf8(text.data, text.size)) return input_.fail(Reason::Utf8, text.data);
    // CORBA 3.3 part 2, section 9.3.2.7: the only NUL is the last byte. rclpy and rclc read no further than
    // the first.
    return !Sink::kMakesCdr || text.size == 0 ||
           std::memchr(text.data, 0, static_cast<size_t>(text.size)) == nullptr ||
           input_.fail(Reason::NulInString, text.data);
  }

  // Messages of fixed size
  // -------------------------------------------------------------------------------------------

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
      p = input_.likely_tag(tag_place, range.end, by_number, by_declaration, &op, &wire_type);
      if (p == nullptr && (p = input_.tag(message, tag_place, range.end, &op, &wire_type)) == nullptr)
        return false;
      const uint8_t* data;
      uint64_t number = 0;
      if ((p = input_.value(p, range.end, wire_type, &data, &number)) == nullptr) return false;
      if (op == nullptr || !ProtobufInput::fits(*op, wire_type)) continue;
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
    return visit(op.cdr, [&](auto form) ROSIDL_PROTO_INLINE_LAMBDA -> bool {
      using F = decltype(form);
      if constexpr (F::kIsNumber) {
        typename F::Raw raw{};
        if (!from_wire<F>(value, &raw)) return false;
        store_little(out, raw);
        return true;
      } else if constexpr (F::kIsString) {
        return false;
      } else {
        return place(plan_.message(op.message), {data, data + value}, start, out);
      }
    });
  }

  static bool place_many(const Operation& op, WireType wire_type, const uint8_t* data, uint64_t size,
                         uint8_t* out) {
    return visit(op.cdr, [&](auto form) ROSIDL_PROTO_INLINE_LAMBDA -> bool {
      using F = decltype(form);
      if constexpr (F::kIsNumber) {
        const bool same = F::kCopiesToCdr && !F::kIsText;
        if (!same || wire_type != WireType::Delimited || size != op.count * F::kSize) return false;
        copy(out, data, size);
        return true;
      }
      return false;
    });
  }

  const Plan& plan_;
  ProtobufInput input_;
  Sink sink_;
};

}  // namespace
}  // namespace rosidl_proto
