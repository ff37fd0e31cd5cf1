#include "described_types.hpp"

#include <algorithm>

#include "../heap_sort.hpp"
#include "../text.hpp"
#include "packed_plan.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto {
namespace {

constexpr const char* kDamaged = "the descriptor set is damaged";
constexpr const char* kLongName = "the descriptor set has a name of more than 512 bytes";

// Messages in messages of a descriptor, which protobuf's own parsers do not let go deeper.
constexpr int kMaximumNesting = 100;

constexpr uint64_t tag(uint32_t number, WireType type) {
  return uint64_t{number} << 3 | static_cast<uint64_t>(type);
}
constexpr uint64_t delimited(uint32_t number) { return tag(number, WireType::Delimited); }
constexpr uint64_t varint(uint32_t number) { return tag(number, WireType::Varint); }

// The fields of a serialized message, one after the other.
class WireFields {
 public:
  explicit WireFields(Slice message) : p_(message.data), end_(message.data + message.size) {}

  // Goes to the next field; false behind the last one, or where the message is damaged.
  bool next() {
    if (p_ == nullptr || p_ == end_) return false;
    const uint8_t* const value = get_varint(p_, end_, &tag);
    p_ = value == nullptr || tag < 8 || tag > 0xffffffff ? nullptr : skip_value(value, end_, tag);
    if (p_ == nullptr) return false;
    const auto type = static_cast<WireType>(tag & 7);
    if (type == WireType::Varint) get_varint(value, p_, &number);
    if (type == WireType::Delimited) bytes.data = get_varint(value, p_, &bytes.size);
    return true;
  }

  bool damaged() const { return p_ == nullptr && end_ != nullptr; }
  std::string_view text() const {
    return {reinterpret_cast<const char*>(bytes.data), static_cast<size_t>(bytes.size)};
  }

  uint64_t tag = 0;     // the field number and the wire type
  uint64_t number = 0;  // of a varint
  Slice bytes;          // of a delimited value

 private:
  const uint8_t* p_;
  const uint8_t* const end_;
};

// FeatureSet.message_encoding: whether messages are groups on the wire.
bool read_features(Slice features, bool* is_delimited) {
  WireFields fields(features);
  while (fields.next()) {
    if (fields.tag == varint(5)) *is_delimited = fields.number == 2;
  }
  return !fields.damaged();
}

// The options of a file, a message or a field: `features` is the field number of its FeatureSet.
bool read_options(Slice options, uint32_t features, bool* is_delimited, bool* is_map_entry) {
  WireFields fields(options);
  while (fields.next()) {
    if (fields.tag == delimited(features) && !read_features(fields.bytes, is_delimited)) return false;
    if (fields.tag == varint(7) && is_map_entry != nullptr) *is_map_entry = fields.number != 0;
  }
  return !fields.damaged();
}

constexpr uint32_t kFileFeatures = 50, kMessageFeatures = 12, kFieldFeatures = 21;

std::string full_name(std::string_view scope, std::string_view name) {
  std::string full(scope);
  if (!full.empty()) full += '.';
  return full.append(name);
}

std::string_view without_dot(std::string_view name) {
  return !name.empty() && name[0] == '.' ? name.substr(1) : name;
}

// Reads the options of a field: whether its message is a group, and what kScalarOption tells.
const char* read_field_options(Slice options, bool* is_delimited, DescribedField* field, bool* told) {
  if (!read_options(options, kFieldFeatures, is_delimited, nullptr)) return kDamaged;
  for (WireFields each(options); each.next();) {
    if (each.tag != delimited(kScalarOption)) continue;
    if (*told) return "an option of a field that tells its ROS type is there more than once";
    *told = true;
    if (each.bytes.size == 1) field->scalar = each.bytes.data[0];
  }
  return nullptr;
}

}  // namespace

const char* DescribedTypes::read(Slice set) {
  WireFields files(set);
  while (files.next()) {
    if (files.tag != delimited(1)) continue;
    if (const char* wrong = add_file(files.bytes)) return wrong;
  }
  if (files.damaged()) return kDamaged;
  heap_sort(types_.begin(), types_.end(), [](const DescribedType& a, const DescribedType& b) {
    const int compared = a.name.compare(b.name);
    return compared != 0 ? compared < 0 : a.order < b.order;
  });
  return nullptr;
}

const char* DescribedTypes::add_file(Slice file) {
  std::string_view package;
  bool is_delimited = false;
  WireFields about(file);
  while (about.next()) {
    if (about.tag == delimited(2)) package = about.text();
    if (about.tag == delimited(8) && !read_options(about.bytes, kFileFeatures, &is_delimited, nullptr))
      return kDamaged;
  }
  if (about.damaged()) return kDamaged;
  if (package.size() > kMaximumNameSize) return kLongName;
  for (WireFields types(file); types.next();) {
    const char* wrong = nullptr;
    if (types.tag == delimited(4)) wrong = add_message(types.bytes, package, is_delimited, 1);
    if (types.tag == delimited(5)) wrong = add_enum(types.bytes, package);
    if (wrong != nullptr) return wrong;
  }
  return nullptr;
}

const char* DescribedTypes::add_message(Slice message, std::string_view scope, bool is_delimited, int depth) {
  if (depth > kMaximumNesting) return kDamaged;
  DescribedType type;
  type.content = message;
  type.delimited = is_delimited;
  std::string_view name;
  WireFields about(message);
  while (about.next()) {
    if (about.tag == delimited(1)) name = about.text();
    if (about.tag == delimited(7) &&
        !read_options(about.bytes, kMessageFeatures, &type.delimited, &type.is_map_entry))
      return kDamaged;
  }
  if (about.damaged()) return kDamaged;
  if (const char* wrong = add(scope, name, type)) return wrong;
  const std::string own_scope = full_name(scope, name);
  for (WireFields types(message); types.next();) {
    const char* wrong = nullptr;
    if (types.tag == delimited(3)) wrong = add_message(types.bytes, own_scope, type.delimited, depth + 1);
    if (types.tag == delimited(4)) wrong = add_enum(types.bytes, own_scope);
    if (wrong != nullptr) return wrong;
  }
  return nullptr;
}

const char* DescribedTypes::add_enum(Slice content, std::string_view scope) {
  DescribedType type;
  type.content = content;
  type.is_enum = true;
  std::string_view name;
  WireFields about(content);
  while (about.next()) {
    if (about.tag == delimited(1)) name = about.text();
  }
  return about.damaged() ? kDamaged : add(scope, name, type);
}

const char* DescribedTypes::add(std::string_view scope, std::string_view name, const DescribedType& type) {
  if (scope.size() + name.size() >= kMaximumNameSize) return kLongName;
  if (types_.size() == kMaximumTypes) return "the descriptor set has more than 50000 types";
  types_.push_back(type);
  types_.back().name = full_name(scope, name);
  types_.back().order = types_.size();
  return nullptr;
}

bool DescribedTypes::find(std::string_view name, uint32_t* index) const {
  const auto found =
      std::lower_bound(types_.begin(), types_.end(), name,
                       [](const DescribedType& type, std::string_view wanted) { return type.name < wanted; });
  *index = static_cast<uint32_t>(found - types_.begin());
  return found != types_.end() && found->name == name;
}

bool DescribedTypes::find_message(std::string_view name, uint32_t* index) const {
  return find(without_dot(name), index) && !types_[*index].is_enum;
}

const char* DescribedTypes::read_fields(uint32_t message, size_t most,
                                        std::vector<DescribedField>* fields) const {
  const DescribedType& type = types_[message];
  for (WireFields each(type.content); each.next();) {
    if (each.tag != delimited(2)) continue;
    DescribedField field;
    bool is_group = false;
    if (const char* wrong = read_field(type, each.bytes, &field, &is_group)) return wrong;
    if (is_group || field.name == kFiller) continue;
    if (fields->size() == most) return kTooManyFields;
    fields->push_back(field);
  }
  return nullptr;
}

const char* DescribedTypes::read_field(const DescribedType& message, Slice content, DescribedField* field,
                                       bool* is_group) const {
  std::string_view type_name;
  bool is_delimited = message.delimited, told = false;
  uint64_t number = 0, type = 0;
  WireFields each(content);
  while (each.next()) {
    const char* wrong = nullptr;
    if (each.tag == delimited(1)) field->name = each.text();
    if (each.tag == varint(3)) number = each.number;
    if (each.tag == varint(4)) field->repeated = each.number == 3;
    if (each.tag == varint(5)) type = each.number;
    if (each.tag == delimited(6)) type_name = each.text();
    if (each.tag == delimited(8)) wrong = read_field_options(each.bytes, &is_delimited, field, &told);
    if (wrong != nullptr) return wrong;
  }
  if (each.damaged()) return kDamaged;
  if (number == 0 || number > kMaximumFieldNumber) return "a field has a number that protobuf does not have";
  if (type > kLastType) return "a field has a type that protobuf does not have";
  field->number = static_cast<uint32_t>(number);
  field->type = static_cast<uint8_t>(type);
  *is_group = type == kGroupType;
  const bool has_part = type == 0 || type == kMessageType || type == kEnumType;
  if (!has_part) return nullptr;
  if (const char* wrong = find_part(message, type_name, field)) return wrong;
  // The entries of maps are no groups, and neither is what is in them.
  *is_group = is_delimited && field->type == kMessageType && !message.is_map_entry &&
              !types_[field->part].is_map_entry;
  return nullptr;
}

// Names that do not begin with a dot are looked for in the message, and then farther and farther out.
const char* DescribedTypes::find_part(const DescribedType& message, std::string_view name,
                                      DescribedField* field) const {
  if (name.size() > kMaximumNameSize) return kLongName;
  const bool is_full = !name.empty() && name[0] == '.';
  std::string_view scope = is_full ? std::string_view() : message.name;
  while (!find(full_name(scope, without_dot(name)), &field->part)) {
    if (scope.empty()) return "the descriptor set does not have the type of a field";
    const size_t dot = scope.rfind('.');
    scope = dot == std::string_view::npos ? std::string_view() : scope.substr(0, dot);
  }
  const uint8_t found = types_[field->part].is_enum ? kEnumType : kMessageType;
  if (field->type != 0 && field->type != found) return "the descriptor set does not have the type of a field";
  field->type = found;
  return nullptr;
}

const char* DescribedTypes::read_values(uint32_t index, size_t most, std::vector<FlatNote::EnumValue>* values,
                                        size_t* count) const {
  struct Value {
    int32_t number;
    size_t order;
    std::string_view name;
  };
  std::vector<Value> found;
  for (WireFields each(types_[index].content); each.next();) {
    if (each.tag != delimited(2)) continue;
    if (found.size() == most) return kTooManyValues;
    Value value{0, found.size(), {}};
    WireFields parts(each.bytes);
    while (parts.next()) {
      if (parts.tag == delimited(1)) value.name = parts.text();
      if (parts.tag == varint(2)) value.number = static_cast<int32_t>(parts.number);
    }
    if (parts.damaged()) return kDamaged;
    if (value.name.size() > kMaximumNameSize) return kLongName;
    if (!is_utf8(reinterpret_cast<const uint8_t*>(value.name.data()), value.name.size())) return kDamaged;
    found.push_back(value);
  }
  heap_sort(found.begin(), found.end(), [](const Value& a, const Value& b) {
    return a.number != b.number ? a.number < b.number : a.order < b.order;
  });
  for (const Value& each : found) {
    if (values->empty() || values->back().number != each.number)
      values->push_back({each.number, std::string(each.name)});
  }
  *count = found.size();
  return nullptr;
}

}  // namespace rosidl_proto
