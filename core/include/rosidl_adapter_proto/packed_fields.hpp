// Finds packed repeated fields in a message as protobuf runtimes serialize it: each at most once.
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
  constexpr uint64_t kDelimited = 2;
  while (p < end) {
    uint64_t tag, size = 0;
    p = get_varint(p, end, &tag);
    if (p == nullptr) return false;
    const uint8_t* const value = p;
    p = skip_value(p, end, tag);
    if (p == nullptr) return false;
    if ((tag & 7) != kDelimited) continue;
    for (size_t i = 0; i < count; ++i) {
      if (numbers[i] != tag >> 3) continue;
      if (slices[i].data != nullptr) return false;
      const uint8_t* const content = get_varint(value, end, &size);
      slices[i] = {content, size};
    }
  }
  return true;
}

}  // namespace rosidl_proto
