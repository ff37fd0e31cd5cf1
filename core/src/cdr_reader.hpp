// Reads CDR along a plan, in either byte order, or what ROS 1 has instead, and drives a sink.
#pragma once

#include "cdr.hpp"
#include "sink.hpp"
#include "text.hpp"

namespace rosidl_proto {
namespace {

// `kSwap`: the bytes of numbers are in the other order than here. `kChecked`: what values are is checked,
// which has happened when writing follows measuring; that nothing lies outside of the input is always
// checked.
template <bool kSwap, bool kChecked, class Sink, class Layout = PlainCdr>
class CdrReader {
  using At = typename Sink::At;

  // Where to read and where the sink is; `in` is nullptr after an error.
  struct Cursor {
    const uint8_t* in;
    At at;
  };

 public:
  CdrReader(const Plan& plan, Input cdr, const Sink& sink, Error& error)
      : plan_(plan), input_(cdr, error), sink_(sink), error_(error) {}

  // Reads the whole message; `*at` is where the sink begins, and then where it ended.
  bool run(At* at) {
    const Cursor end = message(plan_.root(), {input_.origin(), *at});
    if (end.in == nullptr) return false;
    *at = end.at;
    if (!sink_.finish(end.at)) return input_.fail(sink_.reason, end.in, sink_.detail) != nullptr;
    return !kChecked || plan_.partial() || is_padding(end.in) ||
           input_.fail(Reason::Trailing, end.in, input_.left(end.in)) != nullptr;
  }

 private:
  // DDS pads to 4 bytes. rmw_serialize gives as many bytes as the message was estimated to need: for
  // bounded types the maximum, else too many for wide strings (one character) and for empty sequences of
  // 8-byte numbers (their alignment), which can then move what follows by another alignment.
  bool is_padding(const uint8_t* p) const {
    if (!Layout::kPadded) return input_.left(p) == 0;
    const uint64_t full = plan_.root().full_size.from(0);
    const uint64_t maximum = full <= kMaximumSize ? full + 3 : 0;
    return input_.left(p) <= 3 + slack_ || input_.left(input_.origin()) <= maximum;
  }

  static Cursor failed() { return {nullptr, At()}; }

  Cursor fail(Reason reason, const uint8_t* p, uint64_t a = 0, uint64_t b = 0) {
    input_.fail(reason, p, a, b);
    return failed();
  }

  // Goes on at `next` unless the sink stopped, which is an error at `place`.
  ROSIDL_PROTO_INLINE Cursor take(const uint8_t* next, At at, const uint8_t* place) {
    if (Sink::failed(at)) return fail(sink_.reason, place, sink_.detail);
    return {next, at};
  }

  Cursor message(const Message& message, Cursor c) {
    const Operation* const last = plan_.end(message);
    for (const Operation* op = plan_.begin(message); op != last; ++op) {
      if (is_absent(*op)) continue;
      if (op->reading == Reading::One) {
        c = one(*op, c);
      } else if (op->reading == Reading::Many) {
        c = many(*op, c);
      } else {
        c.in = skip(*op, c.in);
      }
      if (c.in == nullptr) {
        error_.leave(static_cast<uint32_t>(op - &plan_.operation(0)));
        return c;
      }
    }
    return c;
  }

  ROSIDL_PROTO_INLINE Cursor one(const Operation& op, Cursor c) {
    return visit(op.cdr, [&](auto form) ROSIDL_PROTO_INLINE_LAMBDA -> Cursor {
      using F = decltype(form);
      if constexpr (F::kIsNumber) {
        const uint8_t* const p = input_.align_to(c.in, F::kSize);
        if (p == nullptr) return failed();
        const auto raw = CdrInput<kSwap>::template load<typename F::Raw>(p);
        if (kChecked && !F::is_value(raw)) return not_a_value(op, p, raw);
        if (kChecked && !Layout::kFilled && op.other_sign && raw >> 31 != 0) return not_in_ros2(op, p, raw);
        return take(p + F::kSize, sink_.template number<F>(op, c.at, raw), p);
      } else if constexpr (F::kIsString) {
        return string<F>(op, c, kNoElement);
      } else {
        return submessage(op, c, kNoElement);
      }
    });
  }

  ROSIDL_PROTO_INLINE Cursor many(const Operation& op, Cursor c) {
    return visit(op.cdr, [&](auto form) ROSIDL_PROTO_INLINE_LAMBDA -> Cursor {
      using F = decltype(form);
      if constexpr (F::kIsNumber) {
        return numbers<F>(op, c);
      } else {
        return elements<F>(op, c);
      }
    });
  }

  template <class F>
  ROSIDL_PROTO_NO_INLINE Cursor elements(const Operation& op, Cursor c) {
    uint32_t count;
    const uint8_t* const p = input_.elements(op, c.in, minimum_size<F>(op), &count);
    if (p == nullptr) return failed();
    c = take(p, sink_.elements(op, c.at, count), p);
    for (uint32_t i = 0; c.in != nullptr && i < count; ++i) {
      if constexpr (F::kIsString) {
        c = string<F>(op, c, i);
      } else {
        c = submessage(op, c, i);
      }
      if (c.in == nullptr) error_.element = i;
    }
    return c;
  }

  static bool is_absent(const Operation& op) { return !Layout::kFilled && op.filler; }

  // Finds the end of a field without looking at more than that takes.
  const uint8_t* skip(const Operation& op, const uint8_t* p) {
    return visit(op.cdr, [&](auto form) ROSIDL_PROTO_INLINE_LAMBDA -> const uint8_t* {
      using F = decltype(form);
      const bool single = op.shape == Shape::Single;
      uint32_t count = 1;
      if constexpr (F::kIsNumber) {
        if (!single) return find_numbers<F::kSize>(op, p, &count).after;
        p = input_.align_to(p, F::kSize);
        return p == nullptr ? nullptr : p + F::kSize;
      } else {
        if (!single && (p = input_.elements(op, p, minimum_size<F>(op), &count)) == nullptr) return nullptr;
        if constexpr (!F::kIsString) {
          const Message& part = plan_.message(op.message);
          if (Layout::kAligned && part.fixed) {
            const uint64_t size = part.default_size.from(input_.offset(p), count);
            return input_.need(p, size) == nullptr ? nullptr : p + size;
          }
        }
        for (uint32_t i = 0; i < count; ++i) {
          if ((p = skip_element<F>(op, p)) != nullptr) continue;
          if (!single) error_.element = i;
          break;
        }
        return p;
      }
    });
  }

  template <class F>
  const uint8_t* skip_element(const Operation& op, const uint8_t* p) {
    if constexpr (F::kIsString) {
      const uint8_t* content;
      uint32_t units;
      return find_string<F>(p, &content, &units);
    } else {
      const Message& part = plan_.message(op.message);
      const Operation* const last = plan_.end(part);
      for (const Operation* field = plan_.begin(part); field != last; ++field) {
        if (is_absent(*field)) continue;
        if ((p = skip(*field, p)) != nullptr) continue;
        error_.leave(static_cast<uint32_t>(field - &plan_.operation(0)));
        break;
      }
      return p;
    }
  }

  template <class F>
  uint64_t minimum_size(const Operation& op) const {
    if constexpr (F::kIsString) {
      return F::kMinimumSize;
    } else {
      const Message& part = plan_.message(op.message);
      return Layout::kFilled ? part.minimum_size : part.ros1_minimum_size;
    }
  }

  // Numbers
  // ----------------------------------------------------------------------------------------------------------

  struct Found {
    const uint8_t *begin, *after;  // nullptr after an error
  };

  // Finds the numbers of an array or sequence.
  template <uint64_t kSize>
  ROSIDL_PROTO_INLINE Found find_numbers(const Operation& op, const uint8_t* p, uint32_t* count) {
    if ((p = input_.elements(op, p, kSize, count)) == nullptr) return {};
    if (*count == 0) {
      if (kSize >= 4) slack_ += kSize;
      return {p, p};
    }
    const uint64_t size = *count * kSize;
    if ((p = input_.align_to(p, kSize)) == nullptr || input_.need(p, size) == nullptr) return {};
    return {p, p + size};
  }

  template <class F>
  ROSIDL_PROTO_NO_INLINE Cursor numbers(const Operation& op, Cursor c) {
    uint32_t count;
    const Found found = find_numbers<F::kSize>(op, c.in, &count);
    if (found.after == nullptr) return failed();
    const CdrNumbers<F, kSwap> numbers(found.begin, count);
    if (kChecked && !check(op, numbers)) return failed();
    return take(found.after, sink_.template numbers<F>(op, c.at, numbers), found.begin);
  }

  template <class F>
  bool check(const Operation& op, const CdrNumbers<F, kSwap>& numbers) {
    if constexpr (F::kIsText && F::kTakesAll) {
      const uint64_t alone = lone_surrogate(numbers);
      if (alone == numbers.count()) return true;
      error_.element = static_cast<int64_t>(alone);
      return input_.fail(Reason::Utf16, numbers.place(alone)) != nullptr;
    } else if constexpr (!F::kTakesAll) {
      bool good = true;
      for (uint64_t i = 0; i < numbers.count(); ++i) good &= F::is_value(numbers[i]);
      for (uint64_t i = 0; !good && i < numbers.count(); ++i) {
        if (F::is_value(numbers[i])) continue;
        error_.element = static_cast<int64_t>(i);
        return not_a_value(op, numbers.place(i), numbers[i]).in != nullptr;
      }
    }
    return true;
  }

  Cursor not_a_value(const Operation& op, const uint8_t* p, uint64_t raw) {
    return fail(Reason::CdrValue, p, raw, static_cast<uint64_t>(op.cdr));
  }

  Cursor not_in_ros2(const Operation& op, const uint8_t* p, uint64_t raw) {
    return op.cdr == CdrForm::Int32 ? fail(Reason::Ros1Time, p, raw)
                                    : fail(Reason::Ros1Duration, p, (uint64_t{1} << 32) - raw);
  }

  // Strings
  // ----------------------------------------------------------------------------------------------------------

  // Finds a string, its NUL not counted; returns the place after it.
  template <class F>
  const uint8_t* find_string(const uint8_t* p, const uint8_t** content, uint32_t* units) {
    if ((p = input_.count(p, units)) == nullptr) return nullptr;
    *content = p;
    if constexpr (F::kUnitSize != 1) {
      slack_ += 8;
      if (*units > input_.left(p) / F::kUnitSize)
        return input_.fail(Reason::Count, p - 4, *units, input_.left(p));
      return p + *units * F::kUnitSize;
    } else {
      const uint32_t length = *units;
      if (F::kIsBytes || !Layout::kTerminated)
        return input_.need(p, length) == nullptr ? nullptr : p + length;
      if (length == 0) return p;  // Not in the standard, but Fast CDR and others read and write it
      if (input_.need(p, length) == nullptr) return nullptr;
      *units = length - 1;
      return p + length;
    }
  }

  template <class F>
  Cursor string(const Operation& op, Cursor c, int64_t element) {
    const uint8_t* content;
    uint32_t units;
    const uint8_t* const p = find_string<F>(c.in, &content, &units);
    if (p == nullptr) return failed();
    if constexpr (F::kUnitSize != 1) {
      const CdrUnits<kSwap> wide(content, units);
      if (kChecked && !check_wide(op, wide)) return failed();
      return take(p, sink_.wstring(op, c.at, element, wide), content);
    } else if constexpr (F::kIsBytes) {
      return take(p, sink_.bytes(op, c.at, element, {content, units}), content);
    } else {
      if (Layout::kTerminated && p != content && p[-1] != 0) return fail(Reason::NoTerminator, p - 1);
      const Text text{content, units};
      if (kChecked && !check_text(op, text)) return failed();
      return take(p, sink_.string(op, c.at, element, text), content);
    }
  }

  bool check_text(const Operation& op, Text text) {
    if (!Sink::kAnyText && !is_utf8(text.data, text.size))
      return input_.fail(Reason::Utf8, text.data) != nullptr;
    return text.size <= op.string_bound || check_bound(op, text.data, utf8_code_points(text.data, text.size));
  }

  // The code units of a wide string need not be text: ROS passes on any of them.
  ROSIDL_PROTO_NO_INLINE bool check_wide(const Operation& op, const CdrUnits<kSwap>& wide) {
    uint32_t all = 0;
    for (uint64_t i = 0; i < wide.count(); ++i) all |= wide[i];
    for (uint64_t i = 0; all > 0xffff && i < wide.count(); ++i) {
      if (wide[i] > 0xffff) return input_.fail(Reason::WstringUnit, wide.place(i), wide[i]) != nullptr;
    }
    return wide.count() <= op.string_bound || check_bound(op, wide.place(0), utf16_characters(wide));
  }

  bool check_bound(const Operation& op, const uint8_t* p, uint64_t characters) {
    return characters <= op.string_bound ||
           input_.fail(Reason::StringBound, p, characters, op.string_bound) != nullptr;
  }

  // Messages
  // ---------------------------------------------------------------------------------------------------------

  ROSIDL_PROTO_INLINE Cursor submessage(const Operation& op, Cursor c, int64_t element) {
    const auto nested = sink_.begin(op, c.at, element);
    if (Sink::failed(nested.at)) return fail(sink_.reason, c.in, sink_.detail);
    const Cursor inner = message(plan_.message(op.message), {c.in, nested.at});
    if (inner.in == nullptr) return inner;
    return take(inner.in, sink_.end(op, c.at, nested, inner.at), inner.in);
  }

  const Plan& plan_;
  CdrInput<kSwap, Layout> input_;
  Sink sink_;
  Error& error_;
  uint64_t slack_ = 0;
};

}  // namespace
}  // namespace rosidl_proto
