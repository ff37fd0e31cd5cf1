// A sink that makes a pair of each value, with the path of its field as the key.
//
// A place in this sink is where the next pair goes in the output. The sink never stops: what does not fit, or
// is not shown, is still read to its end.
#pragma once

#include "flat_pairs.hpp"

namespace rosidl_proto {
namespace {

// Writes a decimal number; returns the place after it.
inline uint8_t* put_decimal(uint8_t* out, uint64_t number) {
  unsigned digits = 1;
  for (uint64_t rest = number; rest >= 10; rest /= 10) ++digits;
  for (unsigned i = digits; i-- > 0; number /= 10) out[i] = static_cast<uint8_t>('0' + number % 10);
  return out + digits;
}

// The text of an integer or boolean. It points to itself, so it stays where it is.
class Decimal {
 public:
  Text of(BuiltinType type, uint64_t raw) {
    if (type == BuiltinType::Bool) return of_literal(raw != 0 ? "true" : "false");
    const bool negative = is_signed(type) && signed_value(type, raw) < 0;
    const auto value = static_cast<uint64_t>(signed_value(type, raw));
    text_[0] = '-';
    const uint8_t* const end = put_decimal(text_ + negative, negative ? 0 - value : value);
    return {text_, static_cast<uint64_t>(end - text_)};
  }

 private:
  static Text of_literal(const char* literal) {
    return {reinterpret_cast<const uint8_t*>(literal), std::strlen(literal)};
  }

  uint8_t text_[24 + kSpill];  // of 64 bits there are at most 20 digits
};

// `[12]`, the index of an element.
class IndexText {
 public:
  explicit IndexText(uint64_t index) {
    text_[0] = '[';
    end_ = put_decimal(text_ + 1, index);
    *end_ = ']';
  }
  IndexText(const IndexText&) = delete;
  IndexText& operator=(const IndexText&) = delete;

  Text text() const { return {text_, static_cast<uint64_t>(end_ + 1 - text_)}; }

  // Goes to the next index without dividing.
  void next() {
    uint8_t* digit = end_ - 1;
    while (*digit == '9') *digit-- = '0';
    if (digit == text_) {  // 99 becomes 100
      text_[1] = '1';
      *end_++ = '0';
      *end_ = ']';
    } else {
      ++*digit;
    }
  }

 private:
  uint8_t text_[24 + kSpill];
  uint8_t* end_;
};

class FlatSink : public Stop {
 public:
  using At = uint8_t*;
  static constexpr bool kSizesOnly = false, kPlaces = false, kMakesCdr = false, kAnyText = true;

  // What there was outside of a submessage.
  struct Nested {
    At at;
    uint64_t path_size;
    uint64_t shown;
    uint8_t* room;  // nullptr, unless nothing of the submessage is shown
  };

  // What a flattener has; `path` has room for the longest one.
  struct Setting {
    const Operation* operations;
    const FlatField* fields;
    const uint8_t* names;
    uint8_t* path;
    uint64_t path_size;
    ArrayPolicy policy;
    Input message;
  };

  FlatSink(const Setting& setting, FlatPairs& pairs)
      : set_(setting), path_{setting.path, setting.path_size}, pairs_(pairs) {}

  static bool failed(At at) { return at == nullptr; }
  static At failure() { return nullptr; }

  template <class F>
  ROSIDL_PROTO_INLINE At number(const Operation& op, At at, typename F::Raw raw) {
    return value(op, at, builtin_type(F{}), raw);
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At at, const Numbers& numbers) {
    constexpr BuiltinType type = builtin_type(F{});
    const uint64_t count = numbers.count();
    const uint8_t* const bytes = numbers.bytes();
    const uint64_t outside = enter(op);
    if (bytes != nullptr || numbers.absent()) {
      at = values_together(op, at, type, bytes, count);
      leave(outside);
      return at;
    }
    uint64_t shown = shown_of(count);
    IndexText index(0);
    const bool good = numbers.each([&](typename F::Raw raw) {
      if (shown == 0) return true;
      --shown;
      at = named_or_number(op, at, index.text(), type, raw);
      index.next();
      return true;
    });
    leave(outside);
    return good ? at : nullptr;
  }

  At elements(const Operation& op, At at, uint64_t count) {
    const FlatField& field = field_of(op);
    shown_ = field.single ? count : shown_of(count);
    return at;
  }

  At string(const Operation& op, At at, int64_t element, Text text) {
    const FlatField& field = field_of(op);
    if (field.map_key) return push_key(text), at;
    return element_of(op, at, element,
                      [&](const Text& last) { return pairs_.string(at, path_, last, text); });
  }

  template <class Units>
  At wstring(const Operation& op, At at, int64_t element, const Units& units) {
    return element_of(op, at, element,
                      [&](const Text& last) { return pairs_.characters(at, path_, last, units); });
  }

  // As an array of uint8.
  At bytes(const Operation& op, At at, int64_t element, Text bytes) {
    if (element != kNoElement && static_cast<uint64_t>(element) >= shown_) return at;
    const uint64_t outside = enter(op);
    if (element != kNoElement) push(IndexText(static_cast<uint64_t>(element)).text());
    at = values_together(op, at, BuiltinType::Uint8, bytes.data, bytes.size);
    leave(outside);
    return at;
  }

  Nested begin(const Operation& op, At at, int64_t element) {
    const bool hidden = element != kNoElement && static_cast<uint64_t>(element) >= shown_;
    const Nested nested{at, enter(op), shown_, hidden ? pairs_.close(at) : nullptr};
    if (field_of(op).indexed && !hidden) {
      push(IndexText(static_cast<uint64_t>(element)).text());
    }
    set_.path[path_.size++] = '/';
    return nested;
  }

  At end(const Operation&, At, const Nested& nested, At inner) {
    leave(nested.path_size);
    shown_ = nested.shown;
    if (nested.room != nullptr) pairs_.open(nested.room);
    return inner;
  }

  bool finish(At) { return true; }

 private:
  const FlatField& field_of(const Operation& op) const { return set_.fields[&op - set_.operations]; }
  Text name(const FlatField& field) const { return {set_.names + field.name.place, field.name.size}; }

  void push(const Text& text) {
    copy_exactly(set_.path + path_.size, text.data, text.size);
    path_.size += text.size;
  }
  void push_key(const Text& text) {
    const Utf8Units units(text);
    const uint64_t size = shown_size(units, kMaximumMapKey);
    put_shown(set_.path + path_.size, units, size);
    path_.size += size;
  }
  // Appends the name of a field to the path; returns what `leave` needs.
  uint64_t enter(const Operation& op) {
    const uint64_t outside = path_.size;
    push(name(field_of(op)));
    return outside;
  }
  void leave(uint64_t outside) { path_.size = outside; }

  // How many elements of an array or sequence are shown.
  uint64_t shown_of(uint64_t count) const {
    return count <= set_.policy.maximum ? count : set_.policy.clamp ? set_.policy.maximum : 0;
  }

  // Whether bytes lie in the message, where a blob can tell their place: pieces that were joined do not.
  bool find_bytes(const uint8_t* bytes, uint64_t count, uint32_t* offset) const {
    const auto place = reinterpret_cast<uintptr_t>(bytes),
               begin = reinterpret_cast<uintptr_t>(set_.message.data);
    const uint64_t before = place - begin;
    *offset = static_cast<uint32_t>(before);
    return bytes != nullptr && place >= begin && before <= set_.message.size &&
           count <= set_.message.size - before && before + count <= UINT32_MAX;
  }

  // Calls `show(last)`, where `last` is what follows the path in the key of a field or of an element.
  template <class Show>
  At element_of(const Operation& op, At at, int64_t element, Show show) {
    if (element == kNoElement) return show(name(field_of(op)));
    if (static_cast<uint64_t>(element) >= shown_) return at;
    const uint64_t outside = enter(op);
    at = show(IndexText(static_cast<uint64_t>(element)).text());
    leave(outside);
    return at;
  }

  // A number alone: a value, or a key of the map.
  ROSIDL_PROTO_NO_INLINE At value(const Operation& op, At at, BuiltinType type, uint64_t raw) {
    const FlatField& field = field_of(op);
    if (!field.map_key) return named_or_number(op, at, name(field), type, raw);
    Decimal decimal;
    push(decimal.of(type, raw));
    return at;
  }

  // Numbers that lie together, or that are all zero if there are no bytes; their path is entered.
  ROSIDL_PROTO_NO_INLINE At values_together(const Operation& op, At at, BuiltinType type,
                                            const uint8_t* bytes, uint64_t count) {
    uint32_t offset;
    const bool blob = op.cdr == CdrForm::Uint8 || op.cdr == CdrForm::Int8 || op.cdr == CdrForm::Bytes;
    if (blob && count > set_.policy.maximum && find_bytes(bytes, count, &offset))
      return pairs_.blob(at, path_, {nullptr, 0}, offset, static_cast<uint32_t>(count));
    const uint64_t shown = shown_of(count);
    const uint8_t size = size_of(type);
    IndexText index(0);
    for (uint64_t i = 0; i < shown; ++i, index.next()) {
      const uint64_t raw = bytes == nullptr ? 0 : load_raw(bytes + i * size, size);
      at = named_or_number(op, at, index.text(), type, raw);
    }
    return at;
  }

  static uint64_t load_raw(const uint8_t* p, uint8_t size) {
    switch (size) {
      case 1:
        return *p;
      case 2:
        return load_little<uint16_t>(p);
      case 4:
        return load_little<uint32_t>(p);
      default:
        return load_little<uint64_t>(p);
    }
  }

  // A value of an enumeration is shown by its name, if it has one.
  At named_or_number(const Operation& op, At at, const Text& last, BuiltinType type, uint64_t raw) {
    const FlatField& field = field_of(op);
    if (field.names == nullptr) return pairs_.number(at, path_, last, type, raw);
    using Value = FlatNote::EnumValue;
    const int64_t number = signed_value(type, raw);
    const auto found =
        std::lower_bound(field.names->begin(), field.names->end(), number,
                         [](const Value& each, int64_t wanted) { return each.number < wanted; });
    if (found != field.names->end() && found->number == number) {
      const auto* const data = reinterpret_cast<const uint8_t*>(found->name.data());
      return pairs_.string(at, path_, last, {data, found->name.size()});
    }
    Decimal decimal;
    return pairs_.string(at, path_, last, decimal.of(type, raw));
  }

  const Setting set_;
  Text path_;           // of the message that is being read, with what follows it
  uint64_t shown_ = 0;  // elements of the array or sequence that is being read
  FlatPairs& pairs_;
};

}  // namespace
}  // namespace rosidl_proto
