// Schemas as recordings have them, read into plans without Python.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace rosidl_proto {

// The largest schema that is read, in bytes.
constexpr size_t kMaximumSchemaSize = 4 * 1024 * 1024;

// Reads the text that MCAP calls `ros2msg` (https://mcap.dev/spec/registry#ros2msg): the definition of the
// type, and those of the types in it, each behind a line of 80 `=` and one such as `MSG: std_msgs/Header`. A
// text need not have builtin_interfaces/Time and Duration. Constants and default values are passed over:
// messages can be read without them.
//
// Field numbers are those that generated code has by default, hashes of the names. Returns nullptr, or what
// is wrong.
const char* read_ros2msg(std::string_view text, std::string_view type_name,
                         std::vector<uint8_t>* packed_plan) noexcept;

}  // namespace rosidl_proto
