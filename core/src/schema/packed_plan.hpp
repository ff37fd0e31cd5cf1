// Makes packed plans from schemas: the counterpart of `Plan.pack` in rosidl_adapter_proto/transcode/plan.py,
// byte for byte.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto {

// The most fields that the plan of a schema may have, those of all its messages together.
constexpr uint32_t kMaximumOperations = SchemaLimits{}.operations;

// The field that ROS gives to a message without fields.
constexpr std::string_view kFiller = "structure_needs_at_least_one_member";

// A field of a message to plan. Its name is the same in ROS and in protobuf.
struct PlannedField {
  std::string_view name;
  uint8_t scalar = 0;  // the type id of an element (REP-2011)
  CdrForm cdr = CdrForm::Message;
  ProtobufForm protobuf = ProtobufForm::None;
  Shape shape = Shape::Single;
  uint32_t number = 0;  // 0 if it is not in protobuf
  uint32_t count = kUnbounded;
  uint32_t string_bound = kUnbounded;
  uint32_t message = 0;  // index of the nested message
};

struct PlannedMessage {
  std::string name, protobuf_name;
  std::vector<PlannedField> fields;
};

// The type of a protobuf field whose elements have this form in CDR.
ProtobufForm protobuf_form(CdrForm cdr, Shape shape);

// Returns the plan of the last message. Each message stands behind those that it contains; the packed plan
// has them the other way round.
std::vector<uint8_t> pack_plan(const std::vector<PlannedMessage>& messages);

}  // namespace rosidl_proto
