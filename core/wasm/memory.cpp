// What the C and C++ libraries need of a system, so that a plugin imports nothing.
//
// WebAssembly without its exceptions cannot unwind: what is thrown stops the plugin. So nothing is allocated
// with `new` before `have_memory` has said that it can be.
#include "memory.hpp"

#include <__verbose_abort>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace rosidl_proto::plugin {
namespace {

constexpr uint64_t kPageSize = 65536;

bool fixed = false;

uint64_t memory_size() { return __builtin_wasm_memory_size(0) * kPageSize; }

}  // namespace

FixedMemory::FixedMemory() noexcept { fixed = true; }
FixedMemory::~FixedMemory() { fixed = false; }

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
  void* const memory = std::malloc(static_cast<size_t>(size));
  std::free(memory);
  return memory != nullptr;
}

}  // namespace rosidl_proto::plugin

// What `malloc` gets its memory from.
extern "C" void* sbrk(intptr_t size) {
  using namespace rosidl_proto::plugin;
  constexpr auto kPage = static_cast<intptr_t>(kPageSize);
  if (size == 0) return reinterpret_cast<void*>(static_cast<uintptr_t>(memory_size()));
  const size_t before = fixed || size < 0 || size % kPage != 0
                            ? SIZE_MAX
                            : __builtin_wasm_memory_grow(0, static_cast<size_t>(size / kPage));
  if (before != SIZE_MAX) return reinterpret_cast<void*>(before * static_cast<size_t>(kPageSize));
  errno = ENOMEM;
  return reinterpret_cast<void*>(-1);
}

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

extern "C" {
[[noreturn]] void* __cxa_allocate_exception(std::size_t) noexcept { __builtin_trap(); }
[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) { __builtin_trap(); }
}

// The library's own one prints, and printing would be an import.
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char*, ...) noexcept { __builtin_trap(); }
_LIBCPP_END_NAMESPACE_STD
