// Finds packed repeated fields in a message as protobuf runtimes serialize it: each at most once, and no
// groups.
#pragma once

#include <cstddef>

#include "wire.hpp"

namespace rosidl_proto {

struct Slice {
  const uint8_t* data = nullptr;
  uint64_t size = 0;
};

// Fills `slices` with the values of the fields with these numbers; an absent field keeps its empty slice.
// Returns whether the message could be read.
inline bool find_packed_fields(const uint8_t* p, const uint8_t* end, const uint64_t* numbers, size_t count,
                               Slice* slices) {
  enum WireType { kVarint = 0, kFixed64 = 1, kLengthDelimited = 2, kFixed32 = 5 };
  while (p < end) {
    uint64_t tag, value;
    p = get_varint(p, end, &tag);
    if (p == nullptr) return false;
    switch (tag & 7) {
      case kVarint:
        p = get_varint(p, end, &value);
        if (p == nullptr) return false;
        break;
      case kFixed64:
      case kFixed32: {
        const ptrdiff_t size = (tag & 7) == kFixed64 ? 8 : 4;
        if (end - p < size) return false;
        p += size;
        break;
      }
      case kLengthDelimited:
        p = get_varint(p, end, &value);
        if (p == nullptr || value > static_cast<uint64_t>(end - p)) return false;
        for (size_t i = 0; i < count; ++i) {
          if (numbers[i] != tag >> 3) continue;
          if (slices[i].data != nullptr) return false;
          slices[i] = {p, value};
        }
        p += value;
        break;
      default:
        return false;
    }
  }
  return true;
}

}  // namespace rosidl_proto
