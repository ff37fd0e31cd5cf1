#include "memory.hpp"

#include <cstddef>
#include <cstdlib>
#include <new>

namespace rosidl_proto::plugin {
namespace {

uint64_t memory_size() { return __builtin_wasm_memory_size(0) * kPageSize; }

bool can_allocate(uint64_t size) {
  void* memory = std::malloc(static_cast<size_t>(size));
  asm volatile("" : "+r"(memory));  // else compilers do neither of both
  std::free(memory);
  return memory != nullptr;
}

}  // namespace

bool FixedMemory::now = false;

bool is_memory(uint64_t address, uint64_t size) noexcept {
  return address != 0 && address <= memory_size() && size <= memory_size() - address;
}

std::string_view memory_from(uint64_t address) noexcept {
  if (!is_memory(address, 0)) return {};
  return {reinterpret_cast<const char*>(static_cast<uintptr_t>(address)),
          static_cast<size_t>(memory_size() - address)};
}

bool have_memory(uint64_t size) noexcept {
  if (size > SIZE_MAX / 2) return false;
  uint64_t largest = 0;
  {
    const FixedMemory fixed;
    for (uint64_t step = size; step > 0; step /= 2) {
      if (largest + step <= size && can_allocate(largest + step)) largest += step;
    }
  }
  if (largest == size) return true;
  // `malloc` would get all of it anew. What is there lies at the end, where the rest comes after it.
  void* const most = std::malloc(static_cast<size_t>(largest));
  const bool rest = can_allocate(size - largest);
  std::free(most);
  return rest && can_allocate(size);
}

}  // namespace rosidl_proto::plugin

void* operator new(std::size_t size) {
  void* const memory = std::malloc(size == 0 ? 1 : size);
  if (memory == nullptr) __builtin_trap();
  return memory;
}
void* operator new[](std::size_t size) { return operator new(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t) noexcept { std::free(memory); }
