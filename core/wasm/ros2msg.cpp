#include "encoding.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto::plugin {

const std::string_view kEncoding = "ros2msg";
const Serialization kSerialization = Serialization::Cdr;

std::string_view schema_in(std::string_view memory) noexcept { return memory.substr(0, memory.find('\0')); }

const char* read_schema(std::string_view schema, std::string_view type_name,
                        std::vector<uint8_t>* packed_plan, FlatNotes*) noexcept {
  return read_ros2msg(schema, type_name, packed_plan);
}

}  // namespace rosidl_proto::plugin
