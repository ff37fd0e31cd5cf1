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
  template <BuiltinType type>
  Text of(uint64_t widened) {
    if (type == BuiltinType::Bool) return of_literal(widened != 0 ? "true" : "false");
    const bool negative = is_signed(type) && static_cast<int64_t>(widened) < 0;
    text_[0] = '-';
    const uint8_t* const end = put_decimal(text_ + negative, negative ? 0 - widened : widened);
    return {text_, static_cast<uint64_t>(end - text_)};
  }

  Text of_index(uint64_t index) {
    text_[0] = '[';
    uint8_t* const end = put_decimal(text_ + 1, index);
    *end = ']';
    return {text_, static_cast<uint64_t>(end + 1 - text_)};
  }

 private:
  static Text of_literal(const char* literal) {
    return {reinterpret_cast<const uint8_t*>(literal), std::strlen(literal)};
  }

  uint8_t text_[24 + kSpill] = {};  // of 64 bits there are at most 20 digits
};

class FlatSink : public Stop {
 public:
  using At = uint8_t*;
  static constexpr bool kSizesOnly = false, kPlaces = false, kAllFields = false;

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

  FlatSink(const Setting& setting, FlatPairs& pairs) : set_(setting), pairs_(pairs) {}

  static bool failed(At at) { return at == nullptr; }
  static At failure() { return nullptr; }

  template <class F>
  ROSIDL_PROTO_INLINE At number(const Operation& op, At at, typename F::Raw raw) {
    const FlatField& field = field_of(op);
    if (field.names != nullptr || field.map_key) return noted_number<F>(field, at, raw);
    return pairs_.number<builtin_type(F{})>(at, path(), name(field), raw);
  }

  template <class F, class Numbers>
  At numbers(const Operation& op, At at, const Numbers& numbers) {
    const FlatField& field = field_of(op);
    const uint64_t count = numbers.count();
    uint32_t offset;
    if (count > set_.policy.maximum && is_bytes<F> && find_bytes(numbers.bytes(), count, &offset))
      return pairs_.blob(at, path(), name(field), offset, static_cast<uint32_t>(count));
    const uint64_t outside = set_.path_size;
    push(name(field));
    uint64_t index = 0;
    const bool good = each<F>(numbers, shown_of(count), [&](typename F::Raw raw) {
      Decimal decimal;
      const Text last = decimal.of_index(index++);
      at = field.names != nullptr ? enumerator<F>(field, at, last, raw)
                                  : pairs_.number<builtin_type(F{})>(at, path(), last, raw);
    });
    set_.path_size = outside;
    return good ? at : nullptr;
  }

  At elements(const Operation& op, At at, uint64_t count) {
    const FlatField& field = field_of(op);
    shown_ = field.single ? count : shown_of(count);
    return at;
  }

  At string(const Operation& op, At at, int64_t element, Text text) {
    const FlatField& field = field_of(op);
    if (field.map_key) return push({text.data, cut_size(text, kMaximumMapKey)}), at;
    return element_of(field, at, element, [&](Text last) { return pairs_.string(at, path(), last, text); });
  }

  template <class Units>
  At wstring(const Operation& op, At at, int64_t element, const Units& units) {
    const FlatField& field = field_of(op);
    return element_of(field, at, element, [&](Text last) { return pairs_.wstring(at, path(), last, units); });
  }

  Nested begin(const Operation& op, At at, int64_t element) {
    const FlatField& field = field_of(op);
    const bool hidden = element != kNoElement && static_cast<uint64_t>(element) >= shown_;
    const Nested nested{at, set_.path_size, shown_, hidden ? pairs_.close(at) : nullptr};
    push(name(field));
    if (field.indexed && !hidden) {
      Decimal decimal;
      push(decimal.of_index(static_cast<uint64_t>(element)));
    }
    push_slash();
    return nested;
  }

  At end(const Operation&, At, const Nested& nested, At inner) {
    set_.path_size = nested.path_size;
    shown_ = nested.shown;
    if (nested.room != nullptr) pairs_.open(nested.room);
    return inner;
  }

  bool finish(At) { return true; }

 private:
  template <class F>
  static constexpr bool is_bytes =
      std::is_same_v<F, Form<CdrForm::Uint8>> || std::is_same_v<F, Form<CdrForm::Int8>>;

  const FlatField& field_of(const Operation& op) const { return set_.fields[&op - set_.operations]; }
  Text name(const FlatField& field) const { return {set_.names + field.name.place, field.name.size}; }
  Text path() const { return {set_.path, set_.path_size}; }

  void push(Text text) {
    copy_exactly(set_.path + set_.path_size, text.data, text.size);
    set_.path_size += text.size;
  }
  void push_slash() { set_.path[set_.path_size++] = '/'; }

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
    return pairs_.has_blobs() && bytes != nullptr && place >= begin && before <= set_.message.size &&
           count <= set_.message.size - before && before + count <= UINT32_MAX;
  }

  // Calls `show(raw)` for the first `shown` numbers; false if the others cannot be read.
  template <class F, class Numbers, class Show>
  static bool each(const Numbers& numbers, uint64_t shown, Show show) {
    using Raw = typename F::Raw;
    if (numbers.absent()) {
      for (uint64_t i = 0; i < shown; ++i) show(Raw{0});
    } else if (const uint8_t* const bytes = numbers.bytes()) {
      for (uint64_t i = 0; i < shown; ++i) show(load_little<Raw>(bytes + i * sizeof(Raw)));
    } else {
      return numbers.each([&](Raw raw) {
        if (shown != 0) --shown, show(raw);
        return true;
      });
    }
    return true;
  }

  // Calls `show(last)`, where `last` is what follows the path in the key of a field or of an element.
  template <class Show>
  At element_of(const FlatField& field, At at, int64_t element, Show show) {
    if (element == kNoElement) return show(name(field));
    if (static_cast<uint64_t>(element) >= shown_) return at;
    const uint64_t outside = set_.path_size;
    push(name(field));
    Decimal decimal;
    at = show(decimal.of_index(static_cast<uint64_t>(element)));
    set_.path_size = outside;
    return at;
  }

  template <class F>
  ROSIDL_PROTO_NO_INLINE At noted_number(const FlatField& field, At at, typename F::Raw raw) {
    if (!field.map_key) return enumerator<F>(field, at, name(field), raw);
    Decimal decimal;
    push(decimal.of<builtin_type(F{})>(widened<builtin_type(F{})>(raw)));
    return at;
  }

  // A value of an enumeration: its name, or its number if it has none.
  template <class F>
  ROSIDL_PROTO_NO_INLINE At enumerator(const FlatField& field, At at, Text last, typename F::Raw raw) {
    using Value = FlatNote::EnumValue;
    constexpr BuiltinType type = builtin_type(F{});
    const uint64_t bits = widened<type>(raw);
    const auto number = static_cast<int64_t>(bits);
    const std::vector<Value>& values = *field.names;
    const auto found =
        std::lower_bound(values.begin(), values.end(), number,
                         [](const Value& each, int64_t wanted) { return each.number < wanted; });
    if (found != values.end() && found->number == number) {
      const auto* const data = reinterpret_cast<const uint8_t*>(found->name.data());
      return pairs_.string(at, path(), last, {data, found->name.size()});
    }
    Decimal decimal;
    return pairs_.string(at, path(), last, decimal.of<type>(bits));
  }

  Setting set_;
  uint64_t shown_ = 0;  // elements of the array or sequence that is being read
  FlatPairs& pairs_;
};

}  // namespace
}  // namespace rosidl_proto
