// CDR (OMG CORBA 3.3 part 2, section 9.3; DDS-XTypes 1.3, section 7.4.1: plain CDR, encoding version 1) to
// protobuf.
//
// Fields are written in the order of declaration, which protobuf allows (any order is valid): writing them in
// the order of their numbers would mean to read the CDR twice. Defaults are left out, as every proto3
// serializer does.
#include <limits>

#include "bytes.hpp"
#include "text.hpp"
#include "transcode.hpp"

namespace rosidl_proto {

bool Lengths::grow() {
  const uint64_t capacity = capacity_ * 2;
  if (capacity > std::numeric_limits<size_t>::max() / sizeof(uint32_t)) return false;
  void* memory = std::malloc(static_cast<size_t>(capacity) * sizeof(uint32_t));
  if (memory == nullptr) return false;
  std::memcpy(memory, data_, static_cast<size_t>(size_) * sizeof(uint32_t));
  if (data_ != few_) std::free(data_);
  data_ = static_cast<uint32_t*>(memory);
  capacity_ = capacity;
  return true;
}

namespace {

constexpr uint64_t kHeader = 4;

// A signed number as protobuf's int32 has it: sign-extended to 64 bits, so that negative ones take 10 bytes
// (https://protobuf.dev/programming-guides/encoding/#signed-ints).
inline uint64_t extend(int64_t value) { return static_cast<uint64_t>(value); }

inline unsigned varint_size_16(uint16_t value) { return 1 + (value >= 0x80) + (value >= 0x4000); }
inline unsigned varint_size_16(int16_t value) {
  return value < 0 ? kMaximumVarintBytes : varint_size_16(static_cast<uint16_t>(value));
}

// What both steps need: where the data is, and reads that check before they read. A function that reads takes
// the place where it begins and returns the place after it; nullptr means that `error` is filled in.
template <bool kSwap>
class Reader {
 public:
  Reader(const Plan& plan, Input cdr, Error& error)
      : plan_(plan), origin_(cdr.data + kHeader), end_(cdr.data + cdr.size), error_(error) {}

  uint64_t left(const uint8_t* p) const { return static_cast<uint64_t>(end_ - p); }
  const uint8_t* origin() const { return origin_; }

 protected:
  const uint8_t* fail(Reason reason, const uint8_t* p, uint64_t a = 0, uint64_t b = 0) {
    error_.reason = reason;
    error_.offset = static_cast<uint64_t>(p - origin_) + kHeader;
    error_.a = a;
    error_.b = b;
    return nullptr;
  }

  // Goes to the alignment of numbers of `size` bytes, counted from after the header, with `size` bytes there.
  const uint8_t* align_to(const uint8_t* p, uint64_t size) {
    const uint64_t padding = (0 - static_cast<uint64_t>(p - origin_)) & (size - 1);
    if (left(p) < padding + size) return fail(Reason::Truncated, p, padding + size, left(p));
    return p + padding;
  }

  const uint8_t* need(const uint8_t* p, uint64_t size) {
    if (left(p) < size) return fail(Reason::Truncated, p, size, left(p));
    return p;
  }

  template <class T>
  static T load(const uint8_t* p) {
    const T value = load_little<T>(p);
    return kSwap ? swap(value) : value;
  }

  const uint8_t* read_count(const uint8_t* p, uint32_t* count) {
    if ((p = align_to(p, 4)) == nullptr) return nullptr;
    *count = load<uint32_t>(p);
    return p + 4;
  }

  // Reads the count of a sequence or takes that of an array; checks it against the bound and against what is
  // left.
  const uint8_t* elements(const Operation& op, const uint8_t* p, uint64_t minimum, uint32_t* count) {
    *count = op.count;
    const uint8_t* const before = p;
    if (op.shape == Shape::Sequence) {
      if ((p = read_count(p, count)) == nullptr) return nullptr;
      if (*count > op.count) return fail(Reason::SequenceBound, p - 4, *count, op.count);
    }
    // `minimum` is at most 2^40 and the count below 2^32: the division keeps the product out.
    if (*count > left(p) / minimum) return fail(Reason::Count, before, *count, left(p));
    return p;
  }

  // Reads the length of a string and finds its content without the NUL.
  const uint8_t* string(const uint8_t* p, const uint8_t** content, uint64_t* size) {
    uint32_t length;
    if ((p = read_count(p, &length)) == nullptr) return nullptr;
    *content = p;
    *size = 0;
    if (length == 0) return p;  // Not in the standard, but Fast CDR and others read and write it
    if (need(p, length) == nullptr) return nullptr;
    if (p[length - 1] != 0) return fail(Reason::NoTerminator, p + length - 1);
    *size = length - 1;
    return p + length;
  }

  const uint8_t* wstring(const uint8_t* p, const uint8_t** content, uint32_t* units) {
    if ((p = read_count(p, units)) == nullptr) return nullptr;
    *content = p;
    if (*units > left(p) / 4) return fail(Reason::Count, p - 4, *units, left(p));
    return p + uint64_t{*units} * 4;
  }

  const Plan& plan_;
  const uint8_t* const origin_;
  const uint8_t* const end_;
  Error& error_;
};

template <bool kSwap>
class Measure : Reader<kSwap> {
  using Base = Reader<kSwap>;
  using Base::align_to, Base::elements, Base::end_, Base::error_, Base::fail, Base::left, Base::need,
      Base::origin_, Base::plan_;

 public:
  Measure(const Plan& plan, Input cdr, uint64_t limit, Lengths& lengths, Error& error)
      : Base(plan, cdr, error), limit_(limit), lengths_(lengths) {}

  bool run(uint64_t* size) {
    const Message& root = plan_.root();
    const uint8_t* p = message(root, origin_, size);
    if (p == nullptr) return false;
    if (*size > limit_) return fail(Reason::TooLarge, p, limit_) != nullptr;
    // DDS pads to 4 bytes. rmw_serialize gives as many bytes as the message was estimated to need: for
    // bounded types the maximum, else too many for wide strings (one character) and for empty sequences of
    // 8-byte numbers (their alignment), which can then move what follows by another alignment.
    const uint64_t maximum = root.full_size[0] <= kMaximumSize ? root.full_size[0] + 3 : 0;
    const bool padding = left(p) <= 3 + slack_ || left(origin_) <= maximum;
    return padding || fail(Reason::Trailing, p, left(p)) != nullptr;
  }

 private:
  const uint8_t* message(const Message& message, const uint8_t* p, uint64_t* size) {
    uint64_t total = 0;
    const Operation* const last = plan_.end(message);
    for (const Operation* op = plan_.begin(message); op != last; ++op) {
      p = op->shape == Shape::Single ? one(*op, p, &total) : many(*op, p, &total);
      if (p == nullptr) {
        error_.leave(static_cast<uint32_t>(op - &plan_.operation(0)));
        return nullptr;
      }
    }
    *size = total;
    return p;
  }

  const uint8_t* one(const Operation& op, const uint8_t* p, uint64_t* total) {
    const uint64_t tag = op.tag_size;
    switch (op.kind) {
      case Kind::Placeholder:
        return need(p, 1) ? p + 1 : nullptr;
      case Kind::Bool:
        if (need(p, 1) == nullptr) return nullptr;
        if (*p > 1) return fail(Reason::CdrBool, p, *p);
        *total += *p ? tag + 1 : 0;
        return p + 1;
      case Kind::Uint8:
      case Kind::Char:
        if (need(p, 1) == nullptr) return nullptr;
        *total += *p ? tag + 1 + (*p >> 7) : 0;
        return p + 1;
      case Kind::Int8:
        if (need(p, 1) == nullptr) return nullptr;
        *total += *p ? tag + (*p >> 7 ? kMaximumVarintBytes : 1) : 0;
        return p + 1;
      case Kind::Uint16:
      case Kind::Wchar: {
        if ((p = align_to(p, 2)) == nullptr) return nullptr;
        const auto value = Base::template load<uint16_t>(p);
        *total += value ? tag + varint_size_16(value) : 0;
        return p + 2;
      }
      case Kind::Int16: {
        if ((p = align_to(p, 2)) == nullptr) return nullptr;
        const auto value = static_cast<int16_t>(Base::template load<uint16_t>(p));
        *total += value ? tag + varint_size_16(value) : 0;
        return p + 2;
      }
      case Kind::Fixed32:
        if ((p = align_to(p, 4)) == nullptr) return nullptr;
        *total += load_little<uint32_t>(p) ? tag + 4 : 0;
        return p + 4;
      case Kind::Fixed64:
        if ((p = align_to(p, 8)) == nullptr) return nullptr;
        *total += load_little<uint64_t>(p) ? tag + 8 : 0;
        return p + 8;
      case Kind::String:
        return string(op, p, total, false);
      case Kind::Wstring:
        return wstring(op, p, total, false);
      case Kind::Message:
        return submessage(op, p, total, op.omit_empty);
    }
    return fail(Reason::Changed, p);
  }

  const uint8_t* many(const Operation& op, const uint8_t* p, uint64_t* total) {
    uint32_t count;
    switch (op.kind) {
      case Kind::Uint8:
      case Kind::Int8:
        if ((p = elements(op, p, 1, &count)) == nullptr) return nullptr;
        delimited(op, count, total);
        return p + count;
      case Kind::Char:
        if ((p = elements(op, p, 1, &count)) == nullptr) return nullptr;
        if (!is_utf8(p, count)) return fail(Reason::Utf8, p);
        delimited(op, count, total);
        return p + count;
      case Kind::Wchar:
        return wide_text(op, p, total);
      case Kind::Bool:
        if ((p = elements(op, p, 1, &count)) == nullptr) return nullptr;
        return bools(op, p, count, total);
      case Kind::Uint16:
        return shorts<uint16_t>(op, p, total);
      case Kind::Int16:
        return shorts<int16_t>(op, p, total);
      case Kind::Fixed32:
        return numbers(op, p, 4, total);
      case Kind::Fixed64:
        return numbers(op, p, 8, total);
      case Kind::String:
        if ((p = elements(op, p, 4, &count)) == nullptr) return nullptr;
        return each(count, p, [&](const uint8_t* q) { return string(op, q, total, true); });
      case Kind::Wstring:
        if ((p = elements(op, p, 4, &count)) == nullptr) return nullptr;
        return each(count, p, [&](const uint8_t* q) { return wstring(op, q, total, true); });
      case Kind::Message:
        if ((p = elements(op, p, plan_.message(op.message).minimum_size, &count)) == nullptr) return nullptr;
        return each(count, p, [&](const uint8_t* q) { return submessage(op, q, total, false); });
      case Kind::Placeholder:
        break;
    }
    return fail(Reason::Changed, p);
  }

  template <class Element>
  const uint8_t* each(uint32_t count, const uint8_t* p, Element element) {
    for (uint32_t i = 0; i < count; ++i) {
      p = element(p);
      if (p == nullptr) {
        error_.element = i;
        return nullptr;
      }
    }
    return p;
  }

  // A delimited field that is left out when it is empty.
  static void delimited(const Operation& op, uint64_t size, uint64_t* total) {
    if (size != 0) *total += op.tag_size + varint_size(size) + size;
  }

  const uint8_t* string(const Operation& op, const uint8_t* p, uint64_t* total, bool repeated) {
    const uint8_t* content;
    uint64_t size;
    if ((p = Base::string(p, &content, &size)) == nullptr) return nullptr;
    if (!is_utf8(content, size)) return fail(Reason::Utf8, content);
    if (size > op.string_bound) {
      const uint64_t characters = utf8_code_points(content, size);
      if (characters > op.string_bound)
        return fail(Reason::StringBound, content, characters, op.string_bound);
    }
    if (size != 0 || repeated) *total += op.tag_size + varint_size(size) + size;
    return p;
  }

  const uint8_t* wstring(const Operation& op, const uint8_t* p, uint64_t* total, bool repeated) {
    const uint8_t* content;
    uint32_t units;
    if ((p = Base::wstring(p, &content, &units)) == nullptr) return nullptr;
    uint64_t pairs = 0;
    for (uint32_t i = 0; i < units; ++i) {
      const uint8_t* at = content + uint64_t{i} * 4;
      const auto unit = Base::template load<uint32_t>(at);
      if (unit > 0xffff) return fail(Reason::WstringUnit, at, unit);
      if (!is_surrogate(unit)) continue;
      if (!is_high_surrogate(unit) || i + 1 == units ||
          !is_low_surrogate(Base::template load<uint32_t>(at + 4))) {
        return fail(Reason::Utf16, at);
      }
      ++pairs;
      ++i;
    }
    if (units - pairs > op.string_bound)
      return fail(Reason::StringBound, content, units - pairs, op.string_bound);
    slack_ += 8;
    const uint64_t size = uint64_t{units} * 2;
    if (size != 0 || repeated) *total += op.tag_size + varint_size(size) + size;
    return p;
  }

  const uint8_t* submessage(const Operation& op, const uint8_t* p, uint64_t* total, bool omit_empty) {
    const uint64_t place = lengths_.size();
    if (!lengths_.append()) return fail(Reason::OutOfMemory, p);
    uint64_t size;
    if ((p = message(plan_.message(op.message), p, &size)) == nullptr) return nullptr;
    if (size > limit_) return fail(Reason::TooLarge, p, limit_);
    lengths_[place] = static_cast<uint32_t>(size);
    if (size != 0 || !omit_empty) *total += op.tag_size + varint_size(size) + size;
    return p;
  }

  const uint8_t* bools(const Operation& op, const uint8_t* p, uint32_t count, uint64_t* total) {
    uint8_t all = 0;
    for (uint32_t i = 0; i < count; ++i) all |= p[i];
    for (uint32_t i = 0; all > 1 && i < count; ++i) {
      if (p[i] <= 1) continue;
      error_.element = i;
      return fail(Reason::CdrBool, p + i, p[i]);
    }
    delimited(op, count, total);
    return p + count;
  }

  const uint8_t* numbers(const Operation& op, const uint8_t* p, uint64_t size, uint64_t* total) {
    uint32_t count;
    if ((p = elements(op, p, size, &count)) == nullptr) return nullptr;
    if (count == 0) {
      slack_ += size;
      return p;
    }
    if ((p = align_to(p, size)) == nullptr || need(p, count * size) == nullptr) return nullptr;
    delimited(op, count * size, total);
    return p + count * size;
  }

  template <class T>
  const uint8_t* shorts(const Operation& op, const uint8_t* p, uint64_t* total) {
    uint32_t count;
    if ((p = elements(op, p, 2, &count)) == nullptr || count == 0) return p;
    if ((p = align_to(p, 2)) == nullptr || need(p, uint64_t{count} * 2) == nullptr) return nullptr;
    uint64_t size = 0;
    for (uint32_t i = 0; i < count; ++i) {
      size += varint_size_16(static_cast<T>(Base::template load<uint16_t>(p + uint64_t{i} * 2)));
    }
    return packed(op, p, uint64_t{count} * 2, size, total);
  }

  const uint8_t* wide_text(const Operation& op, const uint8_t* p, uint64_t* total) {
    uint32_t count;
    if ((p = elements(op, p, 2, &count)) == nullptr || count == 0) return p;
    if ((p = align_to(p, 2)) == nullptr || need(p, uint64_t{count} * 2) == nullptr) return nullptr;
    uint64_t size = 0;
    for (uint32_t i = 0; i < count; ++i) {
      const uint8_t* at = p + uint64_t{i} * 2;
      uint32_t unit = Base::template load<uint16_t>(at);
      if (is_surrogate(unit)) {
        const uint32_t low = ++i < count ? Base::template load<uint16_t>(at + 2) : 0;
        if (!is_high_surrogate(unit) || !is_low_surrogate(low)) return fail(Reason::Utf16, at);
        unit = join_surrogates(unit, low);
      }
      size += utf8_size(unit);
    }
    return packed(op, p, uint64_t{count} * 2, size, total);
  }

  // A delimited field whose size in protobuf is kept for the second step.
  const uint8_t* packed(const Operation& op, const uint8_t* p, uint64_t cdr_size, uint64_t size,
                        uint64_t* total) {
    if (size > limit_) return fail(Reason::TooLarge, p, limit_);
    const uint64_t place = lengths_.size();
    if (!lengths_.append()) return fail(Reason::OutOfMemory, p);
    lengths_[place] = static_cast<uint32_t>(size);
    delimited(op, size, total);
    return p + cdr_size;
  }

  const uint64_t limit_;
  Lengths& lengths_;
  uint64_t slack_ = 0;
};

template <bool kSwap>
class Write : Reader<kSwap> {
  using Base = Reader<kSwap>;
  using Base::align_to, Base::elements, Base::end_, Base::error_, Base::fail, Base::left, Base::need,
      Base::origin_, Base::plan_;

 public:
  Write(const Plan& plan, Input cdr, const Lengths& lengths, uint64_t first, Output proto, Error& error)
      : Base(plan, cdr, error),
        lengths_(lengths),
        place_(first),
        out_end_(proto.data + proto.size),
        out_begin_(proto.data) {}

  bool run() {
    Cursor at = message(plan_.root(), {origin_, out_begin_});
    if (at.in == nullptr) return false;
    return at.out == out_end_ || fail(Reason::Changed, at.in) != nullptr;
  }

 private:
  // Where to read and where to write next; `in` is nullptr after an error.
  struct Cursor {
    const uint8_t* in;
    uint8_t* out;
  };

  bool room(const uint8_t* out, uint64_t size) const { return static_cast<uint64_t>(out_end_ - out) >= size; }

  Cursor changed(const uint8_t* p) { return {fail(Reason::Changed, p), nullptr}; }
  static Cursor failed() { return {nullptr, nullptr}; }

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

  Cursor message(const Message& message, Cursor at) {
    const Operation* const last = plan_.end(message);
    for (const Operation* op = plan_.begin(message); op != last; ++op) {
      at = op->shape == Shape::Single ? one(*op, at) : many(*op, at);
      if (at.in == nullptr) {
        error_.leave(static_cast<uint32_t>(op - &plan_.operation(0)));
        return at;
      }
    }
    return at;
  }

  Cursor one(const Operation& op, Cursor at) {
    const uint8_t* p = at.in;
    switch (op.kind) {
      case Kind::Placeholder:
        return need(p, 1) ? Cursor{p + 1, at.out} : failed();
      case Kind::Bool:
      case Kind::Uint8:
      case Kind::Char:
        if (need(p, 1) == nullptr) return failed();
        return varint(op, {p + 1, at.out}, *p);
      case Kind::Int8:
        if (need(p, 1) == nullptr) return failed();
        return varint(op, {p + 1, at.out}, extend(static_cast<int8_t>(*p)));
      case Kind::Uint16:
      case Kind::Wchar:
        if ((p = align_to(p, 2)) == nullptr) return failed();
        return varint(op, {p + 2, at.out}, Base::template load<uint16_t>(p));
      case Kind::Int16:
        if ((p = align_to(p, 2)) == nullptr) return failed();
        return varint(op, {p + 2, at.out}, extend(static_cast<int16_t>(Base::template load<uint16_t>(p))));
      case Kind::Fixed32:
        if ((p = align_to(p, 4)) == nullptr) return failed();
        return fixed<uint32_t>(op, {p + 4, at.out}, Base::template load<uint32_t>(p));
      case Kind::Fixed64:
        if ((p = align_to(p, 8)) == nullptr) return failed();
        return fixed<uint64_t>(op, {p + 8, at.out}, Base::template load<uint64_t>(p));
      case Kind::String:
        return string(op, at, false);
      case Kind::Wstring:
        return wstring(op, at, false);
      case Kind::Message:
        return submessage(op, at, op.omit_empty);
    }
    return changed(p);
  }

  Cursor many(const Operation& op, Cursor at) {
    const uint8_t* p = at.in;
    uint32_t count;
    switch (op.kind) {
      case Kind::Bool:
      case Kind::Uint8:
      case Kind::Int8:
      case Kind::Char:
        if ((p = elements(op, p, 1, &count)) == nullptr) return failed();
        return count == 0 ? Cursor{p, at.out} : delimited(op, {p, at.out}, count);
      case Kind::Wchar:
        return wide_text(op, at);
      case Kind::Uint16:
      case Kind::Int16:
        return shorts(op, at);
      case Kind::Fixed32:
        return numbers<uint32_t>(op, at);
      case Kind::Fixed64:
        return numbers<uint64_t>(op, at);
      case Kind::String:
        if ((p = elements(op, p, 4, &count)) == nullptr) return failed();
        return each(count, {p, at.out}, [&](Cursor next) { return string(op, next, true); });
      case Kind::Wstring:
        if ((p = elements(op, p, 4, &count)) == nullptr) return failed();
        return each(count, {p, at.out}, [&](Cursor next) { return wstring(op, next, true); });
      case Kind::Message:
        if ((p = elements(op, p, plan_.message(op.message).minimum_size, &count)) == nullptr) return failed();
        return each(count, {p, at.out}, [&](Cursor next) { return submessage(op, next, false); });
      case Kind::Placeholder:
        break;
    }
    return changed(p);
  }

  template <class Element>
  Cursor each(uint32_t count, Cursor at, Element element) {
    for (uint32_t i = 0; i < count; ++i) {
      at = element(at);
      if (at.in == nullptr) {
        error_.element = i;
        return at;
      }
    }
    return at;
  }

  Cursor varint(const Operation& op, Cursor at, uint64_t value) {
    if (value == 0) return at;
    if (!room(at.out, op.tag_size + varint_size(value))) return changed(at.in);
    return {at.in, put_varint(put_tag(at.out, op), value)};
  }

  template <class T>
  Cursor fixed(const Operation& op, Cursor at, T value) {
    if (value == 0) return at;
    if (!room(at.out, op.tag_size + sizeof(T))) return changed(at.in);
    uint8_t* out = put_tag(at.out, op);
    store_little(out, value);
    return {at.in, out + sizeof(T)};
  }

  // Writes tag and length if they and the content fit; returns nullptr if not.
  uint8_t* begin_delimited(const Operation& op, uint8_t* out, uint64_t size) {
    if (!room(out, op.tag_size + varint_size(size) + size)) return nullptr;
    return put_varint(put_tag(out, op), size);
  }

  // A delimited field with the same bytes as in CDR.
  Cursor delimited(const Operation& op, Cursor at, uint64_t size) {
    uint8_t* out = begin_delimited(op, at.out, size);
    if (out == nullptr) return changed(at.in);
    copy(out, at.in, size);
    return {at.in + size, out + size};
  }

  Cursor string(const Operation& op, Cursor at, bool repeated) {
    const uint8_t* content;
    uint64_t size;
    const uint8_t* p = Base::string(at.in, &content, &size);
    if (p == nullptr) return failed();
    if (size == 0 && !repeated) return {p, at.out};
    at = delimited(op, {content, at.out}, size);
    return at.in == nullptr ? at : Cursor{p, at.out};
  }

  Cursor wstring(const Operation& op, Cursor at, bool repeated) {
    const uint8_t* content;
    uint32_t units;
    const uint8_t* p = Base::wstring(at.in, &content, &units);
    if (p == nullptr) return failed();
    if (units == 0 && !repeated) return {p, at.out};
    uint8_t* out = begin_delimited(op, at.out, uint64_t{units} * 2);
    if (out == nullptr) return changed(p);
    for (; content != p; content += 4, out += 2) {
      store_little(out, static_cast<uint16_t>(Base::template load<uint32_t>(content)));
    }
    return {p, out};
  }

  bool next_length(uint64_t* size) {
    if (place_ == lengths_.size()) return false;
    *size = lengths_[place_++];
    return true;
  }

  Cursor submessage(const Operation& op, Cursor at, bool omit_empty) {
    uint64_t size;
    if (!next_length(&size)) return changed(at.in);
    uint8_t* out = at.out;
    if (size != 0 || !omit_empty) out = begin_delimited(op, out, size);
    if (out == nullptr) return changed(at.in);
    const Cursor after = message(plan_.message(op.message), {at.in, out});
    if (after.in != nullptr && after.out != out + size) return changed(at.in);
    return after;
  }

  template <class T>
  Cursor numbers(const Operation& op, Cursor at) {
    uint32_t count;
    const uint8_t* p = elements(op, at.in, sizeof(T), &count);
    if (p == nullptr || count == 0) return {p, at.out};
    const uint64_t size = uint64_t{count} * sizeof(T);
    if ((p = align_to(p, sizeof(T))) == nullptr || need(p, size) == nullptr) return failed();
    if (!kSwap) return delimited(op, {p, at.out}, size);
    uint8_t* out = begin_delimited(op, at.out, size);
    if (out == nullptr) return changed(p);
    for (const uint8_t* const last = p + size; p != last; p += sizeof(T), out += sizeof(T)) {
      store_little(out, Base::template load<T>(p));
    }
    return {p, out};
  }

  Cursor shorts(const Operation& op, Cursor at) {
    uint32_t count;
    const uint8_t* p = elements(op, at.in, 2, &count);
    if (p == nullptr || count == 0) return {p, at.out};
    if ((p = align_to(p, 2)) == nullptr || need(p, uint64_t{count} * 2) == nullptr) return failed();
    uint64_t size;
    if (!next_length(&size)) return changed(p);
    uint8_t* out = begin_delimited(op, at.out, size);
    if (out == nullptr) return changed(p);
    const bool is_signed = op.kind == Kind::Int16;
    for (const uint8_t* const last = p + uint64_t{count} * 2; p != last; p += 2) {
      const auto raw = Base::template load<uint16_t>(p);
      const uint64_t value = is_signed ? extend(static_cast<int16_t>(raw)) : raw;
      if (!room(out, varint_size(value))) return changed(p);
      out = put_varint(out, value);
    }
    return {p, out};
  }

  Cursor wide_text(const Operation& op, Cursor at) {
    uint32_t count;
    const uint8_t* p = elements(op, at.in, 2, &count);
    if (p == nullptr || count == 0) return {p, at.out};
    if ((p = align_to(p, 2)) == nullptr || need(p, uint64_t{count} * 2) == nullptr) return failed();
    uint64_t size;
    if (!next_length(&size)) return changed(p);
    uint8_t* out = begin_delimited(op, at.out, size);
    if (out == nullptr) return changed(p);
    for (const uint8_t* const last = p + uint64_t{count} * 2; p != last; p += 2) {
      uint32_t unit = Base::template load<uint16_t>(p);
      if (is_high_surrogate(unit) && last - p >= 4) {
        p += 2;
        unit = join_surrogates(unit, Base::template load<uint16_t>(p));
      }
      if (!room(out, utf8_size(unit))) return changed(p);
      out = put_utf8(out, unit);
    }
    return {p, out};
  }

  const Lengths& lengths_;
  uint64_t place_;
  uint8_t* const out_end_;
  uint8_t* const out_begin_;
};

// The byte order of plain CDR; false and an error for any other encapsulation. The two bytes of options that
// follow its identifier say nothing about plain CDR.
bool byte_order(Input cdr, bool* swapped, Error& error) {
  if (cdr.size < kHeader) {
    error.reason = Reason::Header;
    error.a = cdr.size;
    return false;
  }
  const unsigned id = cdr.data[0] << 8 | cdr.data[1];
  if (id > 1) {
    error.reason = Reason::Encapsulation;
    error.a = id;
    return false;
  }
  *swapped = id == 0;
  return true;
}

}  // namespace

bool measure_cdr_to_proto(const Plan& plan, Input cdr, uint64_t limit, Lengths& lengths, uint64_t* size,
                          Error& error) noexcept {
  bool swapped;
  if (!byte_order(cdr, &swapped, error)) return false;
  if (limit > kMaximumSize) limit = kMaximumSize;
  return swapped ? Measure<true>(plan, cdr, limit, lengths, error).run(size)
                 : Measure<false>(plan, cdr, limit, lengths, error).run(size);
}

bool write_cdr_to_proto(const Plan& plan, Input cdr, const Lengths& lengths, uint64_t first, Output proto,
                        Error& error) noexcept {
  bool swapped;
  if (!byte_order(cdr, &swapped, error)) return false;
  return swapped ? Write<true>(plan, cdr, lengths, first, proto, error).run()
                 : Write<false>(plan, cdr, lengths, first, proto, error).run();
}

}  // namespace rosidl_proto
