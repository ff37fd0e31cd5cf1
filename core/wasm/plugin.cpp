#include "plugin.hpp"

#include <cstdlib>
#include <cstring>

namespace rosidl_proto::plugin {
namespace {

constexpr uint64_t kPageSize = 65536;

// A handle is a number of its own and the place of the parser, counted from 1.
constexpr uint32_t kPlaceBits = 16, kMaximumParsers = (1u << kPlaceBits) - 1, kGenerations = 1u << 15;

struct Entry {
  uint32_t handle = 0;  // the last one that was given for this place
  std::unique_ptr<Parser> parser;
};

std::vector<Entry>& entries() {
  static std::vector<Entry> all;
  return all;
}

uint32_t next_handle(uint32_t handle, uint32_t place) {
  const uint32_t generation = ((handle >> kPlaceBits) + 1) % kGenerations;
  return generation << kPlaceBits | (place + 1);
}

}  // namespace

bool is_memory(uint64_t address, uint64_t size) noexcept {
  const uint64_t all = __builtin_wasm_memory_size(0) * kPageSize;
  return address != 0 && address <= all && size <= all - address;
}

std::string_view text_at(uint32_t address) noexcept {
  if (!is_memory(address, 1)) return {};
  const uint64_t rest = __builtin_wasm_memory_size(0) * kPageSize - address;
  const char* const text = reinterpret_cast<const char*>(address);
  const void* const end = std::memchr(text, 0, static_cast<size_t>(rest));
  if (end == nullptr) return {};
  return {text, static_cast<size_t>(static_cast<const char*>(end) - text)};
}

bool have_memory(uint64_t size) noexcept {
  if (size > SIZE_MAX / 2) return false;
  void* const memory = std::malloc(static_cast<size_t>(size));
  std::free(memory);
  return memory != nullptr;
}

const char* Parser::load(std::string_view, std::string_view) noexcept {
  return "this plugin reads no schemas yet";
}

uint32_t add_parser(std::unique_ptr<Parser> parser) {
  std::vector<Entry>& all = entries();
  uint32_t place = 0;
  while (place < all.size() && all[place].parser) ++place;
  if (place == kMaximumParsers) return 0;
  if (place == all.size()) all.emplace_back();
  all[place].parser = std::move(parser);
  return all[place].handle = next_handle(all[place].handle, place);
}

Parser* find_parser(uint64_t handle) noexcept {
  std::vector<Entry>& all = entries();
  const uint64_t place = (handle & kMaximumParsers) - 1;
  return place < all.size() && all[place].handle == handle ? all[place].parser.get() : nullptr;
}

void remove_parser(uint64_t handle) noexcept {
  if (find_parser(handle) == nullptr) return;
  entries()[(handle & kMaximumParsers) - 1].parser.reset();
}

}  // namespace rosidl_proto::plugin
