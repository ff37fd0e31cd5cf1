// What the dialects of a plugin share: its parsers, and care with what hosts pass.
//
// A trap is never an answer: PlotJuggler ends loading with it. So addresses are checked before they are used,
// parsers are found by handles and not by pointers, and memory is there before anything needs it.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "rosidl_adapter_proto/plan.hpp"

namespace rosidl_proto::plugin {

// Hosts of PlotJuggler 3 give so much for the pairs of a message, and do not say so.
constexpr uint32_t kOutputSize = 1 << 20;

struct Parser {
  Plan plan;

  // Reads a schema. Returns nullptr, or what is wrong with it.
  const char* load(std::string_view type_name, std::string_view schema) noexcept;
};

// The bytes of a host are in the memory of the plugin.
bool is_memory(uint64_t address, uint64_t size) noexcept;

// The bytes at an address, without the NUL that ends them; nullptr data if they have no end.
std::string_view text_at(uint32_t address) noexcept;

// So much can be allocated now, in one piece or in several.
bool have_memory(uint64_t size) noexcept;

// A parser is known by a handle, which is never 0 and not given again soon.
uint32_t add_parser(std::unique_ptr<Parser> parser);
Parser* find_parser(uint64_t handle) noexcept;  // nullptr for what is not the handle of a live parser
void remove_parser(uint64_t handle) noexcept;

}  // namespace rosidl_proto::plugin
