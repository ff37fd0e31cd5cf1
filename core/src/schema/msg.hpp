// Reads the definition of one message: the rules of rosidl_adapter_proto/interfaces/msg.py, with the
// looseness that recordings are read with.
#pragma once

#include "packed_plan.hpp"
#include "recorded.hpp"

namespace rosidl_proto {

class MessageReader {
 public:
  MessageReader(const TypeName& type, bool own_header) : type_(type), own_header_(own_header) {}

  const char* read(std::string_view text);

  // The messages in its fields have no index yet; their types are in `nested`, in the order of the fields.
  std::vector<PlannedField> fields;
  std::vector<TypeName> nested;

 private:
  const char* read_line(std::string_view line);
  const char* read_constant(std::string_view type, std::string_view name);
  const char* read_type(std::string_view text, PlannedField* field, TypeName* nested_type) const;
  const char* read_element(std::string_view text, PlannedField* field, TypeName* nested_type) const;
  const char* read_message_type(std::string_view text, TypeName* nested_type) const;
  const char* check_names();

  const TypeName& type_;
  const bool own_header_;  // whether the package has a message `Header`
  std::vector<std::string_view> constants_;
};

}  // namespace rosidl_proto
