// UTF-8 and UTF-16 (The Unicode Standard, section 3.9), and numbers as errors show them.
#pragma once

#include <cstdint>
#include <string>

namespace rosidl_proto {

// Whether the bytes are well-formed UTF-8.
bool is_utf8(const uint8_t* data, uint64_t size);

// Code points of well-formed UTF-8; of anything else a number that is not larger than `size`.
uint64_t utf8_code_points(const uint8_t* data, uint64_t size);

// UTF-16 code units that well-formed UTF-8 becomes; of anything else a number that is not larger than 2 *
// `size`.
uint64_t utf16_units(const uint8_t* data, uint64_t size);

// Takes the next code point off well-formed UTF-8; `data` < `end`. Returns nullptr at what is not
// well-formed.
const uint8_t* next_code_point(const uint8_t* data, const uint8_t* end, uint32_t* code_point);

inline bool is_surrogate(uint32_t unit) { return (unit & 0xfffff800) == 0xd800; }
inline bool is_high_surrogate(uint32_t unit) { return (unit & 0xfffffc00) == 0xd800; }
inline bool is_low_surrogate(uint32_t unit) { return (unit & 0xfffffc00) == 0xdc00; }
inline uint32_t join_surrogates(uint32_t high, uint32_t low) {
  return 0x10000 + ((high & 0x3ff) << 10) + (low & 0x3ff);
}

// The index of the first surrogate that is not half of a pair; the number of code units if there is none.
template <class Units>
uint64_t lone_surrogate(const Units& units) {
  const uint64_t count = units.count();
  for (uint64_t i = 0; i < count; ++i) {
    if (!is_surrogate(units[i])) continue;
    if (!is_high_surrogate(units[i]) || i + 1 == count || !is_low_surrogate(units[i + 1])) return i;
    ++i;
  }
  return count;
}

// Characters of UTF-16: a pair is one, and so is a surrogate alone, as Python and its ROS messages count
// them.
template <class Units>
uint64_t utf16_characters(const Units& units) {
  uint64_t pairs = 0;
  for (uint64_t i = 1; i < units.count(); ++i) {
    pairs += is_low_surrogate(units[i]) && is_high_surrogate(units[i - 1]);
  }
  return units.count() - pairs;
}

inline unsigned utf8_size(uint32_t code_point) {
  return code_point < 0x80 ? 1 : code_point < 0x800 ? 2 : code_point < 0x10000 ? 3 : 4;
}

// Writes `utf8_size(code_point)` bytes.
uint8_t* put_utf8(uint8_t* out, uint32_t code_point);

// Floating-point numbers with the digits that tell every float32 from the others.
std::string number_text(int64_t number);
std::string number_text(double number);

}  // namespace rosidl_proto
