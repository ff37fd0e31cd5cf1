#include <algorithm>

#include "encoding.hpp"

namespace rosidl_proto::plugin {

const std::string_view kEncoding = "protobuf";
const Serialization kSerialization = Serialization::Protobuf;

std::string_view schema_in(std::string_view memory) noexcept {
  return memory.substr(0, file_descriptor_set_size(bytes_of(memory), memory.size()));
}

// A type takes 700 bytes with a name of the longest kind, and 8 in a schema; there are 50,000 at most.
uint64_t reading_memory(size_t schema_size, const SchemaLimits& limits) noexcept {
  constexpr uint64_t kOfByte = 100, kOfAllTypes = 40 << 20, kOfByteMore = 10;
  constexpr uint64_t kOfOperation = 3'800, kOfEnumValue = 640;
  const uint64_t size = schema_size;
  return std::min(kOfByte * size, kOfAllTypes + kOfByteMore * size) + kOfOperation * limits.operations +
         kOfEnumValue * limits.enum_values;
}

const char* read_schema(std::string_view schema, std::string_view type_name,
                        std::vector<uint8_t>* packed_plan, FlatNotes* notes,
                        const SchemaLimits& limits) noexcept {
  return read_file_descriptor_set(bytes_of(schema), schema.size(), type_name, packed_plan, notes, limits);
}

}  // namespace rosidl_proto::plugin
