#include "field_numbers.hpp"

#include <algorithm>

namespace rosidl_proto {
namespace {

// What may stand behind a name instead of it; names made to collide would take long.
constexpr uint32_t kMaximumAttempts = 100;

// CRC-32 (ISO 3309), which can go on from what is before.
uint32_t crc32(std::string_view text, uint32_t before = 0) {
  uint32_t crc = ~before;
  for (const char each : text) {
    crc ^= static_cast<uint8_t>(each);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc;
}

// Brings a hash into the range of field numbers, without those that protobuf has for itself
// (https://protobuf.dev/programming-guides/proto3/#assigning).
uint32_t field_number(uint32_t hash) {
  constexpr uint32_t kLargest = (1u << 29) - 1, kFirstReserved = 19000, kReserved = 1000;
  const uint32_t number = hash % (kLargest - kReserved) + 1;
  return number < kFirstReserved ? number : number + kReserved;
}

}  // namespace

uint32_t FieldNumbers::add(std::string_view name) {
  const uint32_t hash = crc32(name);
  uint32_t number = field_number(hash);
  for (uint32_t attempt = 0; !use(number); ++attempt) {
    if (attempt == kMaximumAttempts) return 0;
    const char digits[] = {static_cast<char>('0' + attempt / 10), static_cast<char>('0' + attempt % 10)};
    const std::string_view counter(digits, sizeof digits);
    number = field_number(crc32(counter.substr(attempt < 10), hash));
  }
  return number;
}

bool FieldNumbers::use(uint32_t number) {
  const auto place = std::lower_bound(used_.begin(), used_.end(), number);
  if (place != used_.end() && *place == number) return false;
  used_.insert(place, number);
  return true;
}

}  // namespace rosidl_proto
