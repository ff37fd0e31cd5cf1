#include "encoding.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto::plugin {

const std::string_view kEncoding = "protobuf";
const Serialization kSerialization = Serialization::Protobuf;

std::string_view schema_in(std::string_view memory) noexcept {
  return memory.substr(0, file_descriptor_set_size(bytes_of(memory), memory.size()));
}

const char* read_schema(std::string_view schema, std::string_view type_name,
                        std::vector<uint8_t>* packed_plan, FlatNotes* notes) noexcept {
  return read_file_descriptor_set(bytes_of(schema), schema.size(), type_name, packed_plan, notes);
}

}  // namespace rosidl_proto::plugin
