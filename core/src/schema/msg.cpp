#include "msg.hpp"

#include <algorithm>
#include <charconv>

#include "../heap_sort.hpp"
#include "lines.hpp"

namespace rosidl_proto {
namespace {

// What is left of the name of a message without what ROS itself puts around such names has to be a name too.
bool is_message_name(std::string_view text) {
  if (!is_name(text)) return false;
  if (starts_with(text, "Sample_")) text.remove_prefix(7);
  for (const std::string_view suffix : {"_Request", "_Response", "_Goal", "_Result", "_Feedback"}) {
    if (ends_with(text, suffix)) text.remove_suffix(suffix.size());
  }
  return is_name(text);
}

struct Primitive {
  std::string_view name;
  CdrForm cdr;
  uint8_t scalar;
};

// The types of .msg: `SCALARS` in rosidl_adapter_proto/interfaces/scalars.py.
constexpr Primitive kPrimitives[] = {
    {"bool", CdrForm::Boolean, 15},   {"byte", CdrForm::Uint8, 16},    {"char", CdrForm::Uint8, 3},
    {"int8", CdrForm::Int8, 2},       {"uint8", CdrForm::Uint8, 3},    {"int16", CdrForm::Int16, 4},
    {"uint16", CdrForm::Uint16, 5},   {"int32", CdrForm::Int32, 6},    {"uint32", CdrForm::Uint32, 7},
    {"int64", CdrForm::Int64, 8},     {"uint64", CdrForm::Uint64, 9},  {"float32", CdrForm::Float, 10},
    {"float64", CdrForm::Double, 11}, {"string", CdrForm::String, 17}, {"wstring", CdrForm::Wstring, 18},
};
constexpr uint8_t kNestedScalar = 1;

// Names of types in other languages, which would be taken for those of messages.
constexpr std::string_view kTypesElsewhere[] = {"boolean", "double", "float", "int", "long",
                                                "octet",   "short",  "str",   "uint"};

constexpr const char* kNotAType = "a field or constant does not have a type of .msg";

bool is_string(CdrForm cdr) { return cdr == CdrForm::String || cdr == CdrForm::Wstring; }

// Reads a length or a bound: a whole number above 0 that CDR has a count for.
const char* read_count(std::string_view text, uint32_t* count) {
  constexpr size_t kMostDigits = 10;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, *count);
  const bool is_count = error == std::errc() && rest == end && *count != 0 && text.size() <= kMostDigits;
  return is_count ? nullptr : "the length of an array or a bound is not a whole number from 1 to 4294967295";
}

}  // namespace

const char* MessageReader::read(std::string_view text) {
  if (!is_message_name(type_.name)) return "a definition does not have the name of a message";
  while (!text.empty()) {
    const std::string_view line = take_line(&text);
    if (const char* wrong = read_line(strip(line.substr(0, line.find('#'))))) return wrong;
    if (fields.size() > kMaximumOperations) break;
  }
  if (fields.empty()) fields.push_back({kFiller, 3, CdrForm::Uint8});
  return check_names();
}

const char* MessageReader::read_line(std::string_view line) {
  if (line.empty()) return nullptr;
  if (line == "---")
    return "the text is that of a service or an action, of which only those of messages are read";
  const size_t type_end = line.find_first_of(" \t");
  if (type_end == std::string_view::npos) return "a line does not have both a type and a name";
  const std::string_view type = line.substr(0, type_end), rest = strip(line.substr(type_end));
  const size_t equals = rest.find('=');
  if (equals != std::string_view::npos) return read_constant(type, strip(rest.substr(0, equals)));

  PlannedField field;
  TypeName nested_type;
  const size_t name_end = rest.find_first_of(" \t");
  field.name = rest.substr(0, name_end);
  if (!is_name(field.name)) return "a field does not have a name of letters, digits and underscores";
  if (const char* wrong = read_type(type, &field, &nested_type)) return wrong;
  fields.push_back(field);
  if (field.cdr == CdrForm::Message) {
    if (name_end != std::string_view::npos) return "a field that is a message has a default value";
    nested.push_back(nested_type);
  }
  return nullptr;
}

const char* MessageReader::read_constant(std::string_view type, std::string_view name) {
  if (!is_name(name)) return "a constant does not have a name of letters, digits and underscores";
  PlannedField constant;
  TypeName nested_type;
  if (const char* wrong = read_type(type, &constant, &nested_type)) return wrong;
  if (constant.cdr == CdrForm::Message || constant.shape != Shape::Single ||
      constant.string_bound != kUnbounded)
    return "a constant is neither a number nor a bool, string or wstring";
  constants_.push_back(name);
  return nullptr;
}

const char* MessageReader::read_type(std::string_view text, PlannedField* field,
                                     TypeName* nested_type) const {
  const size_t open = text.find('[');
  if (const char* wrong = read_element(text.substr(0, open), field, nested_type)) return wrong;
  if (open == std::string_view::npos) return nullptr;
  std::string_view size = text.substr(open + 1);
  if (!ends_with(size, "]")) return kNotAType;
  size.remove_suffix(1);
  if (size.empty()) {
    field->shape = Shape::Sequence;
    // rosidl_parser gives such a sequence the bound of its strings, by mistake; it is what is installed.
    if (field->cdr == CdrForm::Wstring) field->count = field->string_bound;
    return nullptr;
  }
  const bool is_bound = starts_with(size, "<=");
  field->shape = is_bound ? Shape::Sequence : Shape::Array;
  return read_count(size.substr(is_bound ? 2 : 0), &field->count);
}

const char* MessageReader::read_element(std::string_view text, PlannedField* field,
                                        TypeName* nested_type) const {
  const size_t bound = text.find("<=");
  const std::string_view name = text.substr(0, bound);
  for (const Primitive& each : kPrimitives) {
    if (each.name != name) continue;
    field->cdr = each.cdr;
    field->scalar = each.scalar;
    if (bound == std::string_view::npos) return nullptr;
    return is_string(each.cdr) ? read_count(text.substr(bound + 2), &field->string_bound) : kNotAType;
  }
  field->scalar = kNestedScalar;
  return read_message_type(text, nested_type);
}

const char* MessageReader::read_message_type(std::string_view text, TypeName* nested_type) const {
  *nested_type = {type_.package, "msg", text};
  if (text == "time" || text == "duration") {  // as in ROS 1
    *nested_type = {"builtin_interfaces", "msg", text == "time" ? "Time" : "Duration"};
  } else if (text == "Header" && !own_header_) {
    nested_type->package = "std_msgs";
  }
  const auto* end = std::end(kTypesElsewhere);
  if (std::find(std::begin(kTypesElsewhere), end, text) != end) return kNotAType;
  const size_t slash = text.rfind('/');
  if (slash != std::string_view::npos) {
    nested_type->package = text.substr(0, slash);
    nested_type->name = text.substr(slash + 1);
    if (ends_with(nested_type->package, "/msg")) nested_type->package.remove_suffix(4);
  }
  return is_name(nested_type->package) && is_message_name(nested_type->name) ? nullptr : kNotAType;
}

const char* MessageReader::check_names() {
  std::vector<std::string_view> names;
  names.reserve(fields.size());
  for (const PlannedField& each : fields) names.push_back(each.name);
  for (std::vector<std::string_view>* each : {&names, &constants_}) {
    heap_sort(each->begin(), each->end());
    if (std::adjacent_find(each->begin(), each->end()) != each->end())
      return "a definition has two fields or two constants with the same name";
  }
  return nullptr;
}

}  // namespace rosidl_proto
