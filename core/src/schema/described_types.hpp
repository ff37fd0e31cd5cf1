// The messages and enums in a serialized FileDescriptorSet, as
// https://github.com/protocolbuffers/protobuf/blob/main/src/google/protobuf/descriptor.proto has them.
// Nothing is copied but the names of types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rosidl_adapter_proto/flat.hpp"
#include "rosidl_adapter_proto/packed_fields.hpp"

namespace rosidl_proto {

// Memory is bounded by these: so many types, and so many bytes in the full name of a type or in the name of
// an enum's value.
constexpr size_t kMaximumTypes = 50'000, kMaximumNameSize = 512;

// FieldDescriptorProto.Type, as far as they are no forms of fields of a plan.
constexpr uint8_t kGroupType = 10, kMessageType = 11, kEnumType = 14, kLastType = 18;

struct DescribedType {
  std::string name;  // in full
  Slice content;     // its DescriptorProto or EnumDescriptorProto
  size_t order = 0;  // among all types of the set
  bool is_enum = false;
  bool is_map_entry = false;
  bool delimited = false;  // messages in its fields are groups, unless a field says otherwise
};

struct DescribedField {
  std::string_view name;
  uint32_t number = 0;
  uint8_t type = 0;
  bool repeated = false;
  uint8_t scalar = 0;  // what kScalarOption tells; 0 if it is not there
  uint32_t part = 0;   // the index of its message or enum
};

class DescribedTypes {
 public:
  // Finds all types. Returns nullptr, or what is wrong. The set stays where it is.
  const char* read(Slice set);

  // The index of a message with a full name, with or without a dot before it; false if there is none.
  bool find_message(std::string_view name, uint32_t* index) const;

  // Reads the fields of a message, without groups and without what ROS has in empty messages; at most `most`.
  const char* read_fields(uint32_t message, size_t most, std::vector<DescribedField>* fields) const;

  // Reads the values of an enum, sorted, the first one of those with the same number; `*count` is the number
  // of all, of which there may be `most`.
  const char* read_values(uint32_t index, size_t most, std::vector<FlatNote::EnumValue>* values,
                          size_t* count) const;

  const DescribedType& operator[](uint32_t index) const { return types_[index]; }
  size_t size() const { return types_.size(); }

 private:
  const char* add_file(Slice file);
  const char* add_message(Slice message, std::string_view scope, bool delimited, int depth);
  const char* add_enum(Slice content, std::string_view scope);
  const char* add(std::string_view scope, std::string_view name, const DescribedType& type);
  const char* read_field(const DescribedType& message, Slice content, DescribedField* field,
                         bool* is_group) const;
  const char* find_part(const DescribedType& message, std::string_view name, DescribedField* field) const;
  bool find(std::string_view name, uint32_t* index) const;

  std::vector<DescribedType> types_;  // sorted by name
};

}  // namespace rosidl_proto
