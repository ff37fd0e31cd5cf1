// The memory of a plugin. It grows while parsers are made, and never while messages are read.
#pragma once

#include <cstdint>
#include <string_view>

namespace rosidl_proto::plugin {

constexpr uint64_t kPageSize = 65536;

// Whether so many bytes at an address are memory. No host knows address 0.
bool is_memory(uint64_t address, uint64_t size) noexcept;

// All memory from an address on; none if there is no such address.
std::string_view memory_from(uint64_t address) noexcept;

// Whether so much can be allocated now, in one piece or in several.
bool have_memory(uint64_t size) noexcept;

// While there is one of these, the memory keeps its size and place: hosts have pointers into it.
class FixedMemory {
 public:
  FixedMemory() noexcept { now = true; }
  FixedMemory(const FixedMemory&) = delete;
  FixedMemory& operator=(const FixedMemory&) = delete;
  ~FixedMemory() { now = false; }

  static bool now;
};

}  // namespace rosidl_proto::plugin
