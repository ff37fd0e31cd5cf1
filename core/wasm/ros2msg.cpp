#include <algorithm>

#include "encoding.hpp"

namespace rosidl_proto::plugin {

const std::string_view kEncoding = "ros2msg";
const Serialization kSerialization = Serialization::Cdr;

std::string_view schema_in(std::string_view memory) noexcept { return memory.substr(0, memory.find('\0')); }

// A field takes 500 bytes, and 6 in a schema; a definition takes 2,000 with a name of the longest kind, and
// 90 in a schema. There are 20,000 and 10,000 at most.
uint64_t reading_memory(size_t schema_size, const SchemaLimits&) noexcept {
  constexpr uint64_t kOfByte = 100, kOfAllDefinitions = 32 << 20, kOfByteMore = 10;
  const uint64_t size = schema_size;
  return std::min(kOfByte * size, kOfAllDefinitions + kOfByteMore * size);
}

const char* read_schema(std::string_view schema, std::string_view type_name,
                        std::vector<uint8_t>* packed_plan, FlatNotes*, const SchemaLimits&) noexcept {
  constexpr size_t kMaximumTypeName = 256;  // it may be in those of all definitions
  if (type_name.size() > kMaximumTypeName) return "the name of the type has more than 256 bytes";
  return read_ros2msg(schema, type_name, packed_plan);
}

}  // namespace rosidl_proto::plugin
