// Writes pairs of a key and a value in one of the formats of flat.hpp, and never past the end of the output.
//
// A place is where the next pair goes. A pair that does not fit is not begun, and none fits after it.
#pragma once

#include <algorithm>
#include <type_traits>

#include "rosidl_adapter_proto/flat.hpp"
#include "rosidl_adapter_proto/wire.hpp"
#include "sink.hpp"
#include "text.hpp"

namespace rosidl_proto {
namespace {

// The types of values in the formats of PlotJuggler 3.
enum class BuiltinType : uint8_t {
  Uint8 = 0,
  Uint16 = 1,
  Uint32 = 2,
  Uint64 = 3,
  Int8 = 8,
  Int16 = 9,
  Int32 = 10,
  Int64 = 11,
  Float32 = 16,
  Float64 = 17,
  String = 18,
  Blob = 19,
  Bool = 20,
};

constexpr BuiltinType builtin_type(CdrForm form) {
  switch (form) {
    case CdrForm::Boolean:
      return BuiltinType::Bool;
    case CdrForm::Uint8:
    case CdrForm::Char:
      return BuiltinType::Uint8;
    case CdrForm::Int8:
      return BuiltinType::Int8;
    case CdrForm::Uint16:
    case CdrForm::Wchar:
      return BuiltinType::Uint16;
    case CdrForm::Int16:
      return BuiltinType::Int16;
    case CdrForm::Uint32:
    case CdrForm::Varuint32:
      return BuiltinType::Uint32;
    case CdrForm::Int32:
    case CdrForm::Varint32:
    case CdrForm::Zigzag32:
      return BuiltinType::Int32;
    case CdrForm::Float:
      return BuiltinType::Float32;
    case CdrForm::Uint64:
    case CdrForm::Varuint64:
      return BuiltinType::Uint64;
    case CdrForm::Int64:
    case CdrForm::Varint64:
    case CdrForm::Zigzag64:
      return BuiltinType::Int64;
    case CdrForm::Double:
      return BuiltinType::Float64;
    case CdrForm::String:
    case CdrForm::Wstring:
    case CdrForm::Bytes:
    case CdrForm::Message:
      return BuiltinType::String;
  }
  return BuiltinType::String;
}

template <CdrForm form>
constexpr BuiltinType builtin_type(Form<form>) {
  return builtin_type(form);
}

constexpr bool is_signed(BuiltinType type) { return type >= BuiltinType::Int8 && type <= BuiltinType::Int64; }

// The kinds of values in the module format.
enum class ModuleKind : uint8_t { Float64, Int64, Uint64, Bool, String };

constexpr ModuleKind module_kind(BuiltinType type) {
  if (type == BuiltinType::Bool) return ModuleKind::Bool;
  if (type == BuiltinType::Float32 || type == BuiltinType::Float64) return ModuleKind::Float64;
  return is_signed(type) ? ModuleKind::Int64 : ModuleKind::Uint64;
}

// The size of a number.
constexpr uint8_t size_of(BuiltinType type) {
  switch (type) {
    case BuiltinType::Uint8:
    case BuiltinType::Int8:
    case BuiltinType::Bool:
      return 1;
    case BuiltinType::Uint16:
    case BuiltinType::Int16:
      return 2;
    case BuiltinType::Uint32:
    case BuiltinType::Int32:
    case BuiltinType::Float32:
      return 4;
    default:
      return 8;
  }
}

// Numbers are handed over as their bits in CDR, without a sign. This is the value of an integer.
inline int64_t signed_value(BuiltinType type, uint64_t raw) {
  const int above = 64 - 8 * size_of(type);
  return is_signed(type) ? static_cast<int64_t>(raw << above) >> above : static_cast<int64_t>(raw);
}

// As modules have it: of an integer its value, of a floating-point number the bits of a double.
inline uint64_t wide_value(BuiltinType type, uint64_t raw) {
  if (type != BuiltinType::Float32) return static_cast<uint64_t>(signed_value(type, raw));
  float number;
  const auto bits = static_cast<uint32_t>(raw);
  std::memcpy(&number, &bits, sizeof number);
  const double wide = number;
  std::memcpy(&raw, &wide, sizeof raw);
  return raw;
}

// Copies are made in whole words, so behind what is read there are kSpill more bytes.
constexpr uint64_t kSpill = 8;

ROSIDL_PROTO_INLINE uint8_t* copy_words(uint8_t* to, const uint8_t* from, uint64_t size) {
  for (uint64_t i = 0; i < size; i += kSpill) store_little(to + i, load_little<uint64_t>(from + i));
  return to + size;
}

inline uint8_t* copy_exactly(uint8_t* to, const uint8_t* from, uint64_t size) {
  copy(to, from, size);
  return to + size;
}

// Takes a character off UTF-16; half of a surrogate pair is U+FFFD (The Unicode Standard, section 3.9).
template <class Units>
uint32_t next_character(const Units& units, uint64_t* index) {
  const uint32_t unit = units[(*index)++];
  if (!is_surrogate(unit)) return unit;
  if (!is_high_surrogate(unit) || *index == units.count() || !is_low_surrogate(units[*index])) return 0xfffd;
  return join_surrogates(unit, units[(*index)++]);
}

// What should be UTF-8, read as such.
class Utf8Units {
 public:
  explicit Utf8Units(const Text& text) : text_(text) {}

  uint64_t count() const { return text_.size; }
  const uint8_t* place(uint64_t index) const { return text_.data + index; }

 private:
  Text text_;
};

// Takes a character off it; a byte that is part of none is U+FFFD.
inline uint32_t next_character(const Utf8Units& units, uint64_t* index) {
  uint32_t code_point;
  const uint8_t* const begin = units.place(*index);
  const uint8_t* const after = next_code_point(begin, units.place(units.count()), &code_point);
  *index += after == nullptr ? 1 : static_cast<uint64_t>(after - begin);
  return after == nullptr ? 0xfffd : code_point;
}

// The size as UTF-8 of as many characters at the beginning as have no more than `limit` bytes.
template <class Units>
uint64_t shown_size(const Units& units, uint64_t limit) {
  uint64_t size = 0;
  for (uint64_t i = 0; i < units.count();) {
    const unsigned more = utf8_size(next_character(units, &i));
    if (more > limit - size) break;
    size += more;
  }
  return size;
}

// Writes characters as UTF-8 until there are `size` bytes; returns the place after them.
template <class Units>
uint8_t* put_shown(uint8_t* out, const Units& units, uint64_t size) {
  const uint8_t* const end = out + size;
  for (uint64_t i = 0; out != end;) out = put_utf8(out, next_character(units, &i));
  return out;
}

// The size of as many characters at the beginning of UTF-8 as have no more than `limit` bytes.
inline uint64_t cut_size(Text text, uint64_t limit) {
  if (text.size <= limit) return text.size;
  while (limit > 0 && (text.data[limit] & 0xc0) == 0x80) --limit;
  return limit;
}

class FlatPairs {
 public:
  using At = uint8_t*;

  FlatPairs(FlatFormat format, Output output)
      : format_(format), begin_(output.data), end_(output.data + output.size), names_(end_) {}

  // The place of the first pair, or nullptr.
  At begin() {
    const uint64_t header = format_ == FlatFormat::Module ? kModuleHeader : sizeof(uint32_t);
    return left(begin_) < header ? nullptr : begin_ + header;
  }

  // Writes what comes before the pairs; returns the size of everything.
  uint64_t finish(At at) {
    if (format_ == FlatFormat::Module) return finish_module(at);
    store_little(begin_, count_);
    return static_cast<uint64_t>(at - begin_);
  }

  // A key is a path and what follows it.
  ROSIDL_PROTO_NO_INLINE At number(At at, const Text& path, const Text& last, BuiltinType type,
                                   uint64_t raw) {
    if (format_ == FlatFormat::Module) return module_number(at, path, last, type, raw);
    const uint8_t size = size_of(type);
    const bool page_boolean = type == BuiltinType::Bool && format_ == FlatFormat::Page;
    uint8_t* const value = pair(at, path, last, page_boolean ? BuiltinType::Uint8 : type, size);
    if (value == nullptr) return at;
    if (left(value) >= sizeof raw) {
      store_little(value, raw);  // what is too much is written over
    } else {
      std::memcpy(value, &raw, size);
    }
    return value + size;
  }

  At string(At at, const Text& path, const Text& last, Text text) {
    if (!is_utf8(text.data, text.size)) return characters(at, path, last, Utf8Units(text));
    text.size = cut_size(text, largest_size());
    uint8_t* const value = string_pair(at, path, last, text.size);
    return value == nullptr ? at : copy_exactly(value, text.data, text.size);
  }

  template <class Units>
  At characters(At at, const Text& path, const Text& last, const Units& units) {
    const uint64_t size = shown_size(units, largest_size());
    uint8_t* const value = string_pair(at, path, last, size);
    return value == nullptr ? at : put_shown(value, units, size);
  }

  // Modules have no blobs.
  At blob(At at, const Text& path, const Text& last, uint32_t offset, uint32_t size) {
    if (format_ == FlatFormat::Module) return at;
    uint8_t* const value = pair(at, path, last, BuiltinType::Blob, 2 * sizeof(uint32_t));
    if (value == nullptr) return at;
    store_little(value, offset);
    store_little(value + sizeof(uint32_t), size);
    return value + 2 * sizeof(uint32_t);
  }

  // Lets nothing fit behind `at`. Returns what lets it fit again as before.
  uint8_t* close(At at) {
    uint8_t* const before = end_;
    end_ = at;
    return before;
  }
  void open(uint8_t* before) { end_ = before; }

 private:
  static constexpr uint64_t kModuleHeader = 24, kModuleEntry = 9, kModuleCount = 20;

  uint64_t left(At at) const { return static_cast<uint64_t>(end_ - at); }
  uint64_t largest_size() const { return format_ == FlatFormat::Page ? 0xffff : 0xffffffff; }
  uint64_t size_bytes() const { return format_ == FlatFormat::Page ? sizeof(uint16_t) : sizeof(uint32_t); }

  uint8_t* put_size(uint8_t* out, uint64_t size) const {
    if (format_ == FlatFormat::Page) {
      store_little(out, static_cast<uint16_t>(size));
    } else {
      store_little(out, static_cast<uint32_t>(size));
    }
    return out + size_bytes();
  }

  // Writes all of a pair but the value, which takes `size` bytes; returns its place, or nullptr.
  uint8_t* pair(At at, const Text& path, const Text& last, BuiltinType type, uint64_t size) {
    const uint64_t key = path.size + last.size, needed = size_bytes() + key + 1 + size;
    if (left(at) < needed) return close(at), nullptr;
    ++count_;
    uint8_t* out = put_size(at, key);
    if (left(at) - needed >= kSpill) {
      out = copy_words(copy_words(out, path.data, path.size), last.data, last.size);
    } else {
      out = copy_exactly(copy_exactly(out, path.data, path.size), last.data, last.size);
    }
    *out = static_cast<uint8_t>(type);
    return out + 1;
  }

  // The same of a pair whose value is text of `size` bytes.
  uint8_t* string_pair(At at, const Text& path, const Text& last, uint64_t size) {
    const uint64_t whole = size_bytes() + size;
    uint8_t* const value = format_ == FlatFormat::Module
                               ? module_pair(at, path, last, ModuleKind::String, whole)
                               : pair(at, path, last, BuiltinType::String, whole);
    return value == nullptr ? nullptr : put_size(value, size);
  }

  // Modules
  // ----------------------------------------------------------------------------------------------------------

  // Names follow the last value. Until that is known they lie at the end of the output, the first one last.
  uint8_t* module_pair(At at, const Text& path, const Text& last, ModuleKind kind, uint64_t size) {
    const uint64_t key = path.size + last.size;
    if (left(at) < kModuleEntry + size + key) return close(at), nullptr;
    ++count_;
    end_ = names_ = end_ - key;
    copy_exactly(copy_exactly(names_, path.data, path.size), last.data, last.size);
    store_little(at, static_cast<uint32_t>(names_ - begin_));
    store_little(at + 4, static_cast<uint32_t>(key));
    at[8] = static_cast<uint8_t>(kind);
    return at + kModuleEntry;
  }

  At module_number(At at, const Text& path, const Text& last, BuiltinType type, uint64_t raw) {
    const ModuleKind kind = module_kind(type);
    uint8_t* const value = module_pair(at, path, last, kind, value_size(kind));
    if (value == nullptr) return at;
    if (kind == ModuleKind::Bool) {
      *value = static_cast<uint8_t>(raw);
    } else {
      store_little(value, wide_value(type, raw));
    }
    return value + value_size(kind);
  }

  static uint64_t value_size(ModuleKind kind) { return kind == ModuleKind::Bool ? 1 : 8; }

  uint64_t finish_module(At at) {
    const auto gap = static_cast<uint32_t>(names_ - at);
    uint8_t* entry = begin_ + kModuleHeader;
    for (uint32_t i = 0; i < count_; ++i) {
      store_little(entry, load_little<uint32_t>(entry) - gap);
      const auto kind = static_cast<ModuleKind>(entry[8]);
      entry += kModuleEntry;
      entry += kind == ModuleKind::String ? 4 + load_little<uint32_t>(entry) : value_size(kind);
    }
    const auto size = static_cast<uint64_t>(end_of_names_ - names_);
    std::memmove(at, names_, static_cast<size_t>(size));
    std::memset(begin_, 0, kModuleHeader);
    begin_[0] = begin_[2] = 1;
    store_little(begin_ + kModuleCount, count_);
    return static_cast<uint64_t>(at - begin_) + size;
  }

  const FlatFormat format_;
  uint8_t* const begin_;
  uint8_t* end_;    // of what pairs may take
  uint8_t* names_;  // of a module
  uint8_t* const end_of_names_ = end_;
  uint32_t count_ = 0;
};

}  // namespace
}  // namespace rosidl_proto
