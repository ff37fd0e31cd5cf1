// What the dialects of a plugin share: its parsers, which hosts know by handles.
//
// A trap is never an answer: PlotJuggler stops loading a file with it. So nothing that a host says is
// believed, neither addresses nor handles, and there is memory before anything needs it.
#pragma once

#include <cstdint>
#include <memory>
#include <string_view>
#include <vector>

#include "rosidl_adapter_proto/flat.hpp"

// Makes a function one of those that hosts call.
#define ROSIDL_PROTO_EXPORT(name) extern "C" __attribute__((export_name(#name), used))

namespace rosidl_proto::plugin {

// The most that a message is flattened to: hosts of PlotJuggler 3 have so much room, and do not say so.
constexpr uint64_t kOutputSize = 1 << 20;

// For anything small.
constexpr uint64_t kSomeMemory = 256 << 10;

constexpr const char* kNoMemory = "there is not enough memory";

struct Parser {
  std::unique_ptr<Flattener> flattener;  // none before there is a schema
  std::unique_ptr<uint8_t[]> output;     // of PlotJuggler 4; others have their own
  Error error;                           // of the last message
  const char* wrong = "";                // of anything else

  // Reads a schema, in place of the one before. Returns nullptr, or what is wrong.
  const char* load(std::string_view type_name, std::string_view schema) noexcept;

  const char* load(const std::vector<uint8_t>& packed_plan, FlatNotes notes) noexcept;

  // Returns how many bytes were written, or 0 and an error.
  uint64_t flatten(FlatFormat format, Input message, Output output) noexcept;
};

// The handle of a new parser, which is above 0 and does not come again soon; 0 if there is no room for one.
uint32_t add_parser() noexcept;
// The parser with this handle, or nullptr.
Parser* find_parser(uint64_t handle) noexcept;
void remove_parser(uint64_t handle) noexcept;

}  // namespace rosidl_proto::plugin
