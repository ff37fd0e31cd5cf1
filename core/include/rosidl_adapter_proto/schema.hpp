// Schemas as recordings have them, read into plans without Python.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "flat.hpp"

namespace rosidl_proto {

// The largest schema that is read, in bytes.
constexpr size_t kMaximumSchemaSize = size_t{4} << 20;

// Reads the text that MCAP calls `ros2msg` (https://mcap.dev/spec/registry#ros2msg): the definition of the
// type, and those of the types in it, each behind a line of 80 `=` and one such as `MSG: std_msgs/Header`. A
// text need not have builtin_interfaces/Time and Duration. Constants and default values are passed over:
// messages can be read without them.
//
// Field numbers are those that generated code has by default, hashes of the names. Returns nullptr, or what
// is wrong.
const char* read_ros2msg(std::string_view text, std::string_view type_name,
                         std::vector<uint8_t>* packed_plan) noexcept;

// How much the plan of a schema may have.
struct SchemaLimits {
  uint32_t operations = 20'000;    // the fields of all its messages
  uint32_t enum_values = 100'000;  // those of all its operations
};

// A private field of google.protobuf.FieldOptions: SCALAR_OPTION in
// rosidl_adapter_proto/transcode/protobuf_plan.py.
constexpr uint32_t kScalarOption = 68725;

// Reads a serialized FileDescriptorSet, which MCAP has as the schema of protobuf messages
// (https://mcap.dev/spec/registry#protobuf), and makes the plan of one message, as `protobuf_plan` in
// transcode/protobuf_plan.py does. `type_name` may begin with a dot. Returns nullptr, or what is wrong.
//
// `limits` are for those who cannot do without memory: what is over them is kTooManyFields or kTooManyValues.
const char* read_file_descriptor_set(const uint8_t* data, size_t size, std::string_view type_name,
                                     std::vector<uint8_t>* packed_plan, FlatNotes* notes,
                                     const SchemaLimits& limits = {}) noexcept;

extern const char* const kTooManyFields;
extern const char* const kTooManyValues;

// Finds the size of a serialized FileDescriptorSet of which only is known that a NUL follows, where `room`
// bytes may be read. Returns `room` if none follows.
size_t file_descriptor_set_size(const uint8_t* data, size_t room) noexcept;

}  // namespace rosidl_proto
