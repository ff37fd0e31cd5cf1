#include "text.hpp"

#include <cstdio>

#include "rosidl_adapter_proto/wire.hpp"

namespace rosidl_proto {

const uint8_t* next_code_point(const uint8_t* data, const uint8_t* end, uint32_t* code_point) {
  const uint32_t lead = *data++;
  if (lead < 0x80) {
    *code_point = lead;
    return data;
  }
  // Table 3-7 of the standard: only the second byte has a range of its own, which keeps out overlong forms,
  // surrogates and what lies past U+10FFFF.
  int more;
  uint32_t low = 0x80, high = 0xbf, value;
  if (lead >= 0xc2 && lead <= 0xdf) {
    more = 1;
    value = lead & 0x1f;
  } else if (lead >= 0xe0 && lead <= 0xef) {
    more = 2;
    value = lead & 0x0f;
    if (lead == 0xe0) low = 0xa0;
    if (lead == 0xed) high = 0x9f;
  } else if (lead >= 0xf0 && lead <= 0xf4) {
    more = 3;
    value = lead & 0x07;
    if (lead == 0xf0) low = 0x90;
    if (lead == 0xf4) high = 0x8f;
  } else {
    return nullptr;
  }
  if (end - data < more) return nullptr;
  for (; more > 0; --more) {
    const uint32_t byte = *data++;
    if (byte < low || byte > high) return nullptr;
    value = value << 6 | (byte & 0x3f);
    low = 0x80;
    high = 0xbf;
  }
  *code_point = value;
  return data;
}

namespace {

// Looks at 8 bytes at once, of which the last may be looked at twice.
bool is_ascii(const uint8_t* data, uint64_t size) {
  constexpr uint64_t kHigh = 0x8080808080808080u;
  uint64_t bits = 0;
  if (size >= 8) {
    const uint8_t* const last = data + size - 8;
    for (; data < last; data += 8) bits |= load_little<uint64_t>(data);
    bits |= load_little<uint64_t>(last);
  } else if (size >= 4) {
    bits = load_little<uint32_t>(data) | load_little<uint32_t>(data + size - 4);
  } else {
    for (uint64_t i = 0; i < size; ++i) bits |= data[i];
  }
  return (bits & kHigh) == 0;
}

}  // namespace

bool is_utf8(const uint8_t* data, uint64_t size) {
  constexpr uint64_t kShort = 64;  // where most texts end, and most of them are ASCII
  if (size <= kShort && is_ascii(data, size)) return true;
  const uint8_t* const end = data + size;
  while (data != end) {
    while (end - data >= 8 && (load_little<uint64_t>(data) & 0x8080808080808080u) == 0) data += 8;
    while (data != end && *data < 0x80) ++data;
    while (data != end && *data >= 0x80) {
      uint32_t code_point;
      data = next_code_point(data, end, &code_point);
      if (data == nullptr) return false;
    }
  }
  return true;
}

uint64_t utf8_code_points(const uint8_t* data, uint64_t size) {
  uint64_t count = 0;
  for (uint64_t i = 0; i < size; ++i) count += (data[i] & 0xc0) != 0x80;
  return count;
}

uint64_t utf16_units(const uint8_t* data, uint64_t size) {
  uint64_t count = 0;
  for (uint64_t i = 0; i < size; ++i) count += ((data[i] & 0xc0) != 0x80) + (data[i] >= 0xf0);
  return count;
}

uint8_t* put_utf8(uint8_t* out, uint32_t code_point) {
  const auto tail = [code_point](int shift) {
    return static_cast<uint8_t>(0x80 | (code_point >> shift & 0x3f));
  };
  switch (utf8_size(code_point)) {
    case 1:
      *out++ = static_cast<uint8_t>(code_point);
      return out;
    case 2:
      *out++ = static_cast<uint8_t>(0xc0 | code_point >> 6);
      break;
    case 3:
      *out++ = static_cast<uint8_t>(0xe0 | code_point >> 12);
      *out++ = tail(6);
      break;
    default:
      *out++ = static_cast<uint8_t>(0xf0 | code_point >> 18);
      *out++ = tail(12);
      *out++ = tail(6);
  }
  *out++ = tail(0);
  return out;
}

std::string number_text(int64_t number) { return std::to_string(number); }

std::string number_text(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", number);
  return text;
}

}  // namespace rosidl_proto
