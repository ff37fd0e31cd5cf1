#include <algorithm>
#include <exception>

#include "field_numbers.hpp"
#include "msg.hpp"
#include "recorded.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto {
namespace {

std::string joined(const TypeName& type, std::string_view between, std::string_view before_name) {
  std::string text(type.package);
  return text.append(between).append(type.name_space).append(before_name).append(type.name);
}

// Gives the fields what they are in protobuf.
const char* number_fields(std::vector<PlannedField>& fields) {
  FieldNumbers numbers;
  for (PlannedField& each : fields) {
    const uint32_t number = numbers.add(each.name);
    if (number == 0) return "too many fields of a message have names with the same hash";
    if (each.name == kFiller) continue;
    each.number = number;
    each.protobuf = protobuf_form(each.cdr, each.shape);
  }
  return nullptr;
}

// Collects the messages of a plan, parts first.
class Planner {
 public:
  explicit Planner(Definitions& definitions) : definitions_(definitions) {}

  // `depth` is the number of messages that the type lies in, itself included.
  const char* add(const TypeName& type, uint32_t depth, const Definition** planned);

  const std::vector<PlannedMessage>& messages() const { return messages_; }

 private:
  const char* plan(Definition& definition, uint32_t depth);

  Definitions& definitions_;
  std::vector<PlannedMessage> messages_;
  size_t operations_ = 0;
};

const char* Planner::add(const TypeName& type, uint32_t depth, const Definition** planned) {
  Definition* const definition = definitions_.find(type);
  if (definition == nullptr) return "the text refers to a type and does not define it";
  if (definition->state == Definition::State::Reading) return "messages contain each other";
  if (depth > kMaximumDepth) return "messages are nested more than 100 deep";
  *planned = definition;
  return definition->state == Definition::State::Planned ? nullptr : plan(*definition, depth);
}

const char* Planner::plan(Definition& definition, uint32_t depth) {
  definition.state = Definition::State::Reading;
  const TypeName own_header{definition.type.package, "msg", "Header"};
  MessageReader reader(definition.type, definitions_.find(own_header) != nullptr);
  if (const char* wrong = reader.read(definition.text)) return wrong;
  operations_ += reader.fields.size();
  if (operations_ > kMaximumOperations) return kTooManyFields;
  if (const char* wrong = number_fields(reader.fields)) return wrong;

  definition.height = 1;
  auto nested = reader.nested.begin();
  for (PlannedField& each : reader.fields) {
    if (each.cdr != CdrForm::Message) continue;
    const Definition* part;
    if (const char* wrong = add(*nested++, depth + 1, &part)) return wrong;
    each.message = part->message;
    definition.height = std::max(definition.height, part->height + 1);
  }
  if (definition.height > kMaximumDepth) return "messages are nested more than 100 deep";
  definition.message = static_cast<uint32_t>(messages_.size());
  definition.state = Definition::State::Planned;
  messages_.push_back(
      {joined(definition.type, "/", "/"), joined(definition.type, ".", ".pb."), std::move(reader.fields)});
  return nullptr;
}

const char* read(std::string_view text, std::string_view type_name, std::vector<uint8_t>* packed_plan) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  TypeName type;
  if (!read_type_name(type_name, &type)) return "the type does not have a name such as sensor_msgs/msg/Imu";
  if (text.size() > kMaximumSchemaSize) return "the text has more than 4194304 bytes";
  if (starts_with(text, kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  Definitions definitions;
  if (const char* wrong = definitions.read(text, type)) return wrong;
  if (definitions.find(type) == nullptr) return "the text does not define the type";
  Planner planner(definitions);
  const Definition* root;
  if (const char* wrong = planner.add(type, 1, &root)) return wrong;
  *packed_plan = pack_plan(planner.messages());
  return nullptr;
}

}  // namespace

const char* read_ros2msg(std::string_view text, std::string_view type_name,
                         std::vector<uint8_t>* packed_plan) noexcept {
  try {
    return read(text, type_name, packed_plan);
  } catch (const std::exception&) {
    return "there is not enough memory for the text";
  }
}

}  // namespace rosidl_proto
