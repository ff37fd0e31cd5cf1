// What the C and C++ libraries need of a system, so that a plugin imports nothing.
//
// This file is linked first and asks for nothing of the C library, or that would bring its own `sbrk`.
#include <__verbose_abort>
#include <cstddef>
#include <cstdint>

#include "memory.hpp"

// What `malloc` gets its memory from.
extern "C" void* sbrk(intptr_t size) {
  using namespace rosidl_proto::plugin;
  constexpr auto kPage = static_cast<intptr_t>(kPageSize);
  constexpr auto kRefused = static_cast<size_t>(-1);
  size_t pages = kRefused;
  if (size == 0) pages = __builtin_wasm_memory_size(0);
  if (size > 0 && size % kPage == 0 && !FixedMemory::now)
    pages = __builtin_wasm_memory_grow(0, static_cast<size_t>(size / kPage));
  return reinterpret_cast<void*>(pages == kRefused ? kRefused : pages * static_cast<size_t>(kPage));
}

// WebAssembly without its exceptions cannot unwind: what is thrown stops the plugin. So nothing is allocated
// with `new` before `have_memory` has said that it can be.
extern "C" {
[[noreturn]] void* __cxa_allocate_exception(std::size_t) noexcept { __builtin_trap(); }
[[noreturn]] void __cxa_throw(void*, void*, void (*)(void*)) { __builtin_trap(); }
}

// The library's own one prints, and printing would be an import.
_LIBCPP_BEGIN_NAMESPACE_STD
[[noreturn]] void __libcpp_verbose_abort(const char*, ...) noexcept { __builtin_trap(); }
_LIBCPP_END_NAMESPACE_STD
