#include <algorithm>
#include <exception>
#include <map>

#include "../heap_sort.hpp"
#include "described_types.hpp"
#include "packed_plan.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto {
namespace {

// The rules are those of transcode/protobuf_plan.py, which tells more about them.
constexpr uint32_t kMaximumRecursion = 4;
constexpr const char* kTooDeep = "messages are nested more than 100 deep";

// What a field is by nature, for each FieldDescriptorProto.Type: its form in CDR, and the type id of its
// element (REP-2011).
struct Natural {
  CdrForm cdr;
  uint8_t scalar;
};
constexpr Natural kNatural[kLastType + 1] = {
    {},
    {CdrForm::Double, 11},
    {CdrForm::Float, 10},
    {CdrForm::Varint64, 8},
    {CdrForm::Varuint64, 9},
    {CdrForm::Varint32, 6},
    {CdrForm::Uint64, 9},
    {CdrForm::Uint32, 7},
    {CdrForm::Boolean, 15},
    {CdrForm::String, 17},
    {},
    {CdrForm::Message, 1},
    {CdrForm::Bytes, 3},
    {CdrForm::Varuint32, 7},
    {CdrForm::Varint32, 6},  // an enum
    {CdrForm::Int32, 6},
    {CdrForm::Int64, 8},
    {CdrForm::Zigzag32, 6},
    {CdrForm::Zigzag64, 8},
};

// The form in CDR of each scalar type of ROS, by its type id; none for a nested message and a long double.
constexpr CdrForm kNoForm{};
constexpr CdrForm kRosForms[] = {
    kNoForm,          kNoForm,         CdrForm::Int8,   CdrForm::Uint8,   CdrForm::Int16,
    CdrForm::Uint16,  CdrForm::Int32,  CdrForm::Uint32, CdrForm::Int64,   CdrForm::Uint64,
    CdrForm::Float,   CdrForm::Double, kNoForm,         CdrForm::Char,    CdrForm::Wchar,
    CdrForm::Boolean, CdrForm::Uint8,  CdrForm::String, CdrForm::Wstring,
};

// Makes a field what kScalarOption tells, if that goes together with its protobuf type.
void tell(const DescribedField& described, PlannedField* field) {
  if (described.scalar >= std::size(kRosForms) || kRosForms[described.scalar] == kNoForm) return;
  const CdrForm cdr = kRosForms[described.scalar];
  const auto protobuf = static_cast<ProtobufForm>(described.type);
  visit(cdr, [&](auto form) {
    using F = decltype(form);
    bool is_one_value = false;
    if constexpr (F::kIsNumber) is_one_value = F::kIsOneValue;
    const bool single = protobuf == F::kSingle && !described.repeated;
    if (!single && (protobuf != F::kMany || described.repeated == is_one_value)) return;
    field->scalar = described.scalar;
    field->cdr = cdr;
    field->shape = single ? Shape::Single : Shape::Sequence;
  });
}

PlannedField planned_field(const DescribedField& described) {
  PlannedField field;
  const Natural natural = kNatural[described.type];
  field.name = described.name;
  field.number = described.number;
  field.scalar = natural.scalar;
  field.cdr = natural.cdr;
  field.shape = described.repeated ? Shape::Sequence : Shape::Single;
  // On the wire an enum is an int32.
  field.protobuf =
      described.type == kEnumType ? ProtobufForm::Int32 : static_cast<ProtobufForm>(described.type);
  if (field.cdr == CdrForm::Bytes && !described.repeated) {
    field.cdr = CdrForm::Uint8;
    field.shape = Shape::Sequence;
  }
  tell(described, &field);
  return field;
}

PlannedField filler() {
  PlannedField field;
  field.name = kFiller;
  field.scalar = 3;
  field.cdr = CdrForm::Uint8;
  return field;
}

class Planner {
 public:
  // Where a message stands in the plan, and how many messages lie in each other there, itself included.
  struct Place {
    uint32_t index = 0, height = 0;
  };

  Planner(const DescribedTypes& types, const SchemaLimits& limits)
      : types_(types), limits_(limits), nodes_(types.size()) {}

  const char* run(uint32_t message) {
    Place place;
    if (const char* wrong = find_circles(message, 1)) return wrong;
    return add(message, &place);
  }

  std::vector<uint8_t> packed() const { return pack_plan(messages_); }

  FlatNotes notes() {
    FlatNotes all;
    for (size_t i = notes_.size(); anything_to_say_ && i-- > 0;)
      std::move(notes_[i].begin(), notes_[i].end(), std::back_inserter(all));
    return all;
  }

 private:
  // What is known of a message that is reached. Messages that contain each other are a circle.
  struct Node {
    std::vector<DescribedField> fields;
    uint32_t order = 0;  // in which messages were reached; 0 if not yet
    uint32_t lowest = 0;
    uint32_t circle = 0;    // 0 if not yet known
    uint32_t standing = 0;  // how often it stands on the way down
  };

  const char* find_circles(uint32_t message, uint32_t depth);
  const char* add(uint32_t message, Place* place);
  const char* plan(uint32_t message, Place* place);
  const char* describe(uint32_t message, const DescribedField& described, PlannedField* field,
                       FlatNote* note);
  std::vector<uint32_t> key(uint32_t message) const;

  const DescribedTypes& types_;
  const SchemaLimits limits_;
  std::vector<Node> nodes_;                       // one for each type
  std::vector<uint32_t> open_;                    // reached, and of no circle yet
  std::vector<uint32_t> path_;                    // the way down
  std::map<std::vector<uint32_t>, Place> known_;  // by `key`
  std::vector<PlannedMessage> messages_;          // parts first
  std::vector<FlatNotes> notes_;                  // of each message
  bool anything_to_say_ = false;
  uint32_t reached_ = 0;
  size_t fields_ = 0, operations_ = 0, enum_values_ = 0;  // of all messages
};

// Reads the fields of all messages in a message, and finds the circles (Tarjan's algorithm). A way down on
// which no message stands twice is one in the plan as well, and bounds the recursion.
const char* Planner::find_circles(uint32_t message, uint32_t depth) {
  if (depth > kMaximumDepth) return kTooDeep;
  Node& node = nodes_[message];
  node.order = node.lowest = ++reached_;
  open_.push_back(message);
  if (const char* wrong = types_.read_fields(message, limits_.operations - fields_, &node.fields))
    return wrong;
  fields_ += node.fields.size();
  for (const DescribedField& each : node.fields) {
    if (each.type != kMessageType) continue;
    const Node& part = nodes_[each.part];
    if (part.order == 0) {
      if (const char* wrong = find_circles(each.part, depth + 1)) return wrong;
    }
    if (part.circle == 0) node.lowest = std::min(node.lowest, part.lowest);
  }
  while (node.lowest == node.order && node.circle == 0) {
    nodes_[open_.back()].circle = node.order;
    open_.pop_back();
  }
  return nullptr;
}

// What decides about the fields of the message that the way down has come to: how often each message that it
// is in a circle with stands there.
std::vector<uint32_t> Planner::key(uint32_t message) const {
  std::vector<uint32_t> key;
  for (const uint32_t each : path_) {
    if (nodes_[each].circle == nodes_[message].circle) key.push_back(each);
  }
  heap_sort(key.begin(), key.end());
  key.push_back(message);
  return key;
}

const char* Planner::add(uint32_t message, Place* place) {
  const size_t outer = path_.size();
  ++nodes_[message].standing;
  path_.push_back(message);
  const std::vector<uint32_t> own_key = key(message);
  const auto known = known_.find(own_key);
  if (known == known_.end()) {
    if (path_.size() > kMaximumDepth) return kTooDeep;
    if (const char* wrong = plan(message, place)) return wrong;
    known_.emplace(own_key, *place);
  } else {
    *place = known->second;
  }
  path_.pop_back();
  --nodes_[message].standing;
  return outer + place->height > kMaximumDepth ? kTooDeep : nullptr;
}

const char* Planner::plan(uint32_t message, Place* place) {
  PlannedMessage planned{types_[message].name, types_[message].name, {}};
  FlatNotes notes;
  uint32_t height = 1;
  for (const DescribedField& each : nodes_[message].fields) {
    PlannedField field = planned_field(each);
    if (each.type == kMessageType) {
      if (nodes_[each.part].standing >= kMaximumRecursion) continue;
      Place part;
      if (const char* wrong = add(each.part, &part)) return wrong;
      field.message = part.index;
      height = std::max(height, part.height + 1);
    }
    if (++operations_ > limits_.operations) return kTooManyFields;
    FlatNote note;
    if (const char* wrong = describe(message, each, &field, &note)) return wrong;
    planned.fields.push_back(field);
    notes.push_back(std::move(note));
  }
  if (planned.fields.empty()) {
    if (++operations_ > limits_.operations) return kTooManyFields;
    planned.fields.push_back(filler());
    notes.emplace_back();
  }
  *place = {static_cast<uint32_t>(messages_.size()), height};
  messages_.push_back(std::move(planned));
  notes_.push_back(std::move(notes));
  return nullptr;
}

// Finds out what there is to say of a field. A single message that can contain the one that it is in becomes
// a sequence: else its defaults had no end.
const char* Planner::describe(uint32_t message, const DescribedField& described, PlannedField* field,
                              FlatNote* note) {
  if (described.type == kEnumType) {
    size_t count = 0;
    const char* const wrong =
        types_.read_values(described.part, limits_.enum_values - enum_values_, &note->enum_values, &count);
    enum_values_ += count;
    anything_to_say_ = anything_to_say_ || !note->enum_values.empty();
    return wrong;
  }
  if (described.type != kMessageType) return nullptr;
  note->map = types_[described.part].is_map_entry;
  note->single = !note->map && !described.repeated && !types_[message].is_map_entry &&
                 nodes_[described.part].circle == nodes_[message].circle;
  if (note->single) {
    field->shape = Shape::Sequence;
    field->count = 1;
  }
  anything_to_say_ = anything_to_say_ || note->map || note->single;
  return nullptr;
}

const char* read(Slice set, std::string_view type_name, std::vector<uint8_t>* packed_plan, FlatNotes* notes,
                 const SchemaLimits& limits) {
  if (set.size > kMaximumSchemaSize) return "the descriptor set has more than 4194304 bytes";
  DescribedTypes types;
  if (const char* wrong = types.read(set)) return wrong;
  uint32_t message;
  if (!types.find_message(type_name, &message)) return "the descriptor set does not have the message";
  Planner planner(types, limits);
  if (const char* wrong = planner.run(message)) return wrong;
  *packed_plan = planner.packed();
  *notes = planner.notes();
  return nullptr;
}

}  // namespace

const char* read_file_descriptor_set(const uint8_t* data, size_t size, std::string_view type_name,
                                     std::vector<uint8_t>* packed_plan, FlatNotes* notes,
                                     const SchemaLimits& limits) noexcept {
  try {
    return read({data, size}, type_name, packed_plan, notes, limits);
  } catch (const std::exception&) {
    return "there is not enough memory for the descriptor set";
  }
}

size_t file_descriptor_set_size(const uint8_t* data, size_t room) noexcept {
  constexpr uint8_t kFile = 0x0a;
  const uint8_t* p = data;
  const uint8_t* const end = data + room;
  while (p != nullptr && p != end && *p == kFile) p = skip_value(p + 1, end, kFile);
  return p == nullptr ? room : static_cast<size_t>(p - data);
}

}  // namespace rosidl_proto
