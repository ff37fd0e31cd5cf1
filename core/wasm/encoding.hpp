// What differs between the plugins: how the messages of an encoding, and the schemas of their types, are
// read.
#pragma once

#include <string_view>
#include <vector>

#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto::plugin {

// As PlotJuggler names it.
extern const std::string_view kEncoding;
extern const Serialization kSerialization;

inline const uint8_t* bytes_of(std::string_view text) {
  return reinterpret_cast<const uint8_t*>(text.data());
}

// The bytes of a schema of which a host only gives the beginning: `memory` is all that there is behind it.
std::string_view schema_in(std::string_view memory) noexcept;

// How much memory reading a schema takes at most: counted from what its readers keep of each byte, field and
// name, and of vectors while they grow.
uint64_t reading_memory(size_t schema_size, const SchemaLimits& limits) noexcept;

// Returns nullptr, or what is wrong.
const char* read_schema(std::string_view schema, std::string_view type_name,
                        std::vector<uint8_t>* packed_plan, FlatNotes* notes,
                        const SchemaLimits& limits) noexcept;

}  // namespace rosidl_proto::plugin
