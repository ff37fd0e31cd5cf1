// Unaligned loads and stores, alignment and varints: the few things that both encodings are made of.
#pragma once

#include <cstdint>
#include <cstring>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "The transcoder is written for little-endian machines"
#endif

namespace rosidl_proto {

inline uint8_t swap(uint8_t v) { return v; }
inline uint16_t swap(uint16_t v) { return static_cast<uint16_t>(v << 8 | v >> 8); }
inline uint32_t swap(uint32_t v) { return v << 24 | (v & 0xff00) << 8 | (v >> 8 & 0xff00) | v >> 24; }
inline uint64_t swap(uint64_t v) {
  return uint64_t{swap(static_cast<uint32_t>(v))} << 32 | swap(static_cast<uint32_t>(v >> 32));
}

template <class T>
inline T load_little(const uint8_t* p) {
  T value;
  std::memcpy(&value, p, sizeof(T));
  return value;
}

template <class T>
inline void store_little(uint8_t* p, T value) {
  std::memcpy(p, &value, sizeof(T));
}

// memcpy, which may not be given a null pointer even for no bytes (C11 7.24.1).
inline void copy(uint8_t* to, const uint8_t* from, uint64_t size) {
  if (size != 0) std::memcpy(to, from, static_cast<size_t>(size));
}

// The next multiple of `size`, a power of two.
inline uint64_t align(uint64_t offset, uint64_t size) { return (offset + size - 1) & ~(size - 1); }

// https://protobuf.dev/programming-guides/encoding/#varints
constexpr int kMaximumVarintBytes = 10;

inline unsigned varint_size(uint64_t value) {
  unsigned size = 1;
  for (; value >= 0x80; value >>= 7) ++size;
  return size;
}

inline uint8_t* put_varint(uint8_t* p, uint64_t value) {
  for (; value >= 0x80; value >>= 7) *p++ = static_cast<uint8_t>(value | 0x80);
  *p++ = static_cast<uint8_t>(value);
  return p;
}

// Returns the place after the varint; nullptr if it does not end before `end` or within 10 bytes.
inline const uint8_t* get_varint(const uint8_t* p, const uint8_t* end, uint64_t* value) {
  if (p < end && *p < 0x80) {
    *value = *p;
    return p + 1;
  }
  uint64_t result = 0;
  for (int i = 0; i < kMaximumVarintBytes && p < end; ++i) {
    const uint8_t byte = *p++;
    result |= uint64_t{byte & 0x7fu} << (7 * i);
    if (byte < 0x80) {
      *value = result;
      return i == kMaximumVarintBytes - 1 && byte > 1 ? nullptr : p;
    }
  }
  return nullptr;
}

// As many groups as protobuf's own parsers let stand inside of each other.
constexpr int kMaximumGroups = 100;

const uint8_t* skip_group(const uint8_t* p, const uint8_t* end, uint64_t number, int depth = 1);

// Skips what follows the tag of an unknown field. Returns nullptr if that does not end properly before `end`.
inline const uint8_t* skip_value(const uint8_t* p, const uint8_t* end, uint64_t tag, int depth = 0) {
  uint64_t size = 0;
  switch (tag & 7) {
    case 0:
      return get_varint(p, end, &size);
    case 1:
      size = 8;
      break;
    case 2:
      p = get_varint(p, end, &size);
      break;
    case 3:
      return skip_group(p, end, tag >> 3, depth + 1);
    case 5:
      size = 4;
      break;
    default:
      return nullptr;
  }
  return p != nullptr && size <= static_cast<uint64_t>(end - p) ? p + size : nullptr;
}

// Skips the rest of a group, with its end, which has the field number of its beginning
// (https://protobuf.dev/programming-guides/encoding/#groups).
inline const uint8_t* skip_group(const uint8_t* p, const uint8_t* end, uint64_t number, int depth) {
  uint64_t tag;
  while (p != nullptr && depth <= kMaximumGroups && (p = get_varint(p, end, &tag)) != nullptr) {
    if (tag > 0xffffffff || tag < 8) return nullptr;
    if ((tag & 7) == 4) return tag >> 3 == number ? p : nullptr;
    p = skip_value(p, end, tag, depth);
  }
  return nullptr;
}

}  // namespace rosidl_proto
