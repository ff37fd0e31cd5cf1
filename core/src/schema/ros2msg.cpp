// Reads `ros2msg` texts. The rules are those of rosidl_adapter_proto/interfaces/recorded.py and msg.py, with
// the looseness that recordings are read with.
#include <algorithm>
#include <exception>
#include <tuple>

#include "field_numbers.hpp"
#include "lines.hpp"
#include "packed_plan.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto {
namespace {

constexpr size_t kMaximumDefinitions = 10'000;
constexpr std::string_view kFiller = "structure_needs_at_least_one_member";

bool starts_with(std::string_view text, std::string_view start) {
  return text.substr(0, start.size()) == start;
}

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

bool is_blank(std::string_view text) { return strip(text).empty(); }

bool is_letter(char each) { return (each >= 'A' && each <= 'Z') || (each >= 'a' && each <= 'z'); }
bool is_digit(char each) { return each >= '0' && each <= '9'; }

bool is_name(std::string_view text) {
  return !text.empty() && is_letter(text[0]) && std::all_of(text.begin(), text.end(), [](char each) {
    return is_letter(each) || is_digit(each) || each == '_';
  });
}

// What is left of the name of a message without what ROS itself puts around such names has to be a name too.
bool is_message_name(std::string_view text) {
  if (!is_name(text)) return false;
  if (starts_with(text, "Sample_")) text.remove_prefix(7);
  for (const std::string_view suffix : {"_Request", "_Response", "_Goal", "_Result", "_Feedback"}) {
    if (ends_with(text, suffix)) text.remove_suffix(suffix.size());
  }
  return is_name(text);
}

struct TypeName {
  std::string_view package, space, name;  // std_msgs, msg, Header

  auto parts() const { return std::tie(package, space, name); }
};

bool operator<(const TypeName& a, const TypeName& b) { return a.parts() < b.parts(); }
bool operator==(const TypeName& a, const TypeName& b) { return a.parts() == b.parts(); }

std::string joined(const TypeName& type, std::string_view between, std::string_view before_name) {
  std::string text(type.package);
  return text.append(between).append(type.space).append(before_name).append(type.name);
}

// Reads `pkg/Type` or `pkg/msg/Type`; returns whether it is one.
bool read_type_name(std::string_view text, TypeName* type) {
  const size_t first = text.find('/'), last = text.rfind('/');
  if (first == std::string_view::npos) return false;
  type->package = text.substr(0, first);
  type->space = first == last ? "msg" : text.substr(first + 1, last - first - 1);
  type->name = text.substr(last + 1);
  return is_name(type->package) && is_name(type->name) &&
         (type->space == "msg" || type->space == "srv" || type->space == "action");
}

// One definition in a text.
struct Section {
  enum class State : uint8_t { Unread, Reading, Planned };

  TypeName type;
  std::string_view text;
  State state = State::Unread;
  uint32_t message = 0;  // its index in the plan
  uint32_t height = 0;   // how many messages lie in each other, itself included
};

bool operator<(const Section& a, const TypeName& type) { return a.type < type; }

// Returns whether a line is one of the rules between definitions.
bool is_rule(std::string_view line) {
  constexpr size_t kWidth = 80;
  return line.find_first_not_of('=') >= kWidth && line.size() >= kWidth &&
         line.find_first_not_of(" \t", kWidth) == std::string_view::npos;
}

// Takes off a line up to `\n` or `\r\n`: only those stand around the rules and names between definitions.
std::string_view take_plain_line(std::string_view* text) {
  const size_t end = text->find('\n');
  std::string_view line = text->substr(0, end);
  text->remove_prefix(std::min(line.size() + 1, text->size()));
  if (end != std::string_view::npos && ends_with(line, "\r")) line.remove_suffix(1);
  return line;
}

// The definitions of a text, sorted by their names.
class Sections {
 public:
  // `top` is the type that the text is recorded for.
  const char* read(std::string_view text, const TypeName& top);

  Section* find(const TypeName& type) {
    const auto found = std::lower_bound(sections_.begin(), sections_.end(), type);
    return found != sections_.end() && found->type == type ? &*found : nullptr;
  }

 private:
  const char* split(std::string_view text, const TypeName& top);
  const char* merge();

  std::vector<Section> sections_;
};

// Reads the line behind a rule. `*type` is left without a name if it does not say what follows.
const char* read_heading(std::string_view line, const TypeName& top, TypeName* type) {
  if (starts_with(line, "IDL:"))
    return "the text has definitions in IDL, of which only those in .msg are read";
  if (starts_with(line, "SRV:") || starts_with(line, "ACTION:"))
    return "the text has definitions of services or actions, of which only those of messages are read";
  if (!starts_with(line, "MSG:")) return nullptr;
  line.remove_prefix(std::min(line.find_first_not_of(" \t", 4), line.size()));
  const std::string_view name = line.substr(0, line.find_last_not_of(" \t") + 1);
  *type = {top.package, "msg", name};  // of the same package if it does not say another one
  const bool is_type = name.find('/') == std::string_view::npos ? is_name(name) : read_type_name(name, type);
  return is_type ? nullptr : "a line `MSG: ` of the text does not have the name of a message behind it";
}

const char* Sections::split(std::string_view text, const TypeName& top) {
  sections_.push_back({top, text});
  for (std::string_view rest = text; !rest.empty();) {
    const char* const start = rest.data();
    if (!is_rule(take_plain_line(&rest))) continue;
    std::string_view behind = rest;
    TypeName type;
    if (const char* wrong = read_heading(take_plain_line(&behind), top, &type)) return wrong;
    if (type.name.empty()) continue;
    std::string_view& before = sections_.back().text;
    before = before.substr(0, static_cast<size_t>(start - before.data()));
    sections_.push_back({type, behind});
    rest = behind;
  }
  // A text that begins with a rule has its own type behind one; but a message without fields has no text.
  const bool is_behind = std::any_of(sections_.begin() + 1, sections_.end(),
                                     [&top](const Section& each) { return each.type == top; });
  if (is_blank(sections_.front().text) && (is_behind || top.space != "msg"))
    sections_.erase(sections_.begin());
  return nullptr;
}

bool has_same_words(std::string_view a, std::string_view b) {
  for (;;) {
    const std::string_view word = take_word(&a);
    if (word != take_word(&b)) return false;
    if (word.empty()) return true;
  }
}

// Leaves one section of each type: recorders may write one twice, or an empty one before another.
const char* Sections::merge() {
  std::sort(sections_.begin(), sections_.end(), [](const Section& a, const Section& b) {
    return a.type == b.type ? a.text.data() < b.text.data() : a.type < b.type;
  });
  if (sections_.empty()) return nullptr;
  auto kept = sections_.begin();
  for (auto each = kept + 1; each != sections_.end(); ++each) {
    if (!(each->type == kept->type)) {
      *++kept = *each;
    } else if (is_blank(kept->text)) {
      *kept = *each;
    } else if (!is_blank(each->text) && !has_same_words(kept->text, each->text)) {
      return "the text defines a type twice, not in the same way";
    }
  }
  sections_.erase(kept + 1, sections_.end());
  return sections_.size() > kMaximumDefinitions ? "the text has more than 10000 definitions" : nullptr;
}

const char* Sections::read(std::string_view text, const TypeName& top) {
  if (const char* wrong = split(text, top)) return wrong;
  if (const char* wrong = merge()) return wrong;
  for (const std::string_view name : {"Duration", "Time"}) {  // they are the same in all of ROS 2
    const TypeName type{"builtin_interfaces", "msg", name};
    const auto place = std::lower_bound(sections_.begin(), sections_.end(), type);
    if (place == sections_.end() || !(place->type == type))
      sections_.insert(place, {type, "int32 sec\nuint32 nanosec"});
  }
  return nullptr;
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
  uint64_t value = 0;
  if (text.empty() || text.size() > kMostDigits || !std::all_of(text.begin(), text.end(), is_digit))
    return "the length of an array or a bound is not a whole number from 1 to 4294967295";
  for (const char each : text) value = 10 * value + static_cast<uint64_t>(each - '0');
  if (value == 0 || value > 0xffffffff)
    return "the length of an array or a bound is not a whole number from 1 to 4294967295";
  *count = static_cast<uint32_t>(value);
  return nullptr;
}

// Reads the definition of one message.
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
    std::sort(each->begin(), each->end());
    if (std::adjacent_find(each->begin(), each->end()) != each->end())
      return "a definition has two fields or two constants with the same name";
  }
  return nullptr;
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
  explicit Planner(Sections& sections) : sections_(sections) {}

  // `depth` is the number of messages that the type lies in, itself included.
  const char* add(const TypeName& type, uint32_t depth, const Section** planned);

  const std::vector<PlannedMessage>& messages() const { return messages_; }

 private:
  const char* plan(Section& section, uint32_t depth);

  Sections& sections_;
  std::vector<PlannedMessage> messages_;
  size_t operations_ = 0;
};

const char* Planner::add(const TypeName& type, uint32_t depth, const Section** planned) {
  Section* const section = sections_.find(type);
  if (section == nullptr) return "the text refers to a type and does not define it";
  if (section->state == Section::State::Reading) return "messages contain each other";
  if (depth > kMaximumDepth) return "messages are nested more than 100 deep";
  *planned = section;
  return section->state == Section::State::Planned ? nullptr : plan(*section, depth);
}

const char* Planner::plan(Section& section, uint32_t depth) {
  section.state = Section::State::Reading;
  const TypeName own_header{section.type.package, "msg", "Header"};
  MessageReader reader(section.type, sections_.find(own_header) != nullptr);
  if (const char* wrong = reader.read(section.text)) return wrong;
  operations_ += reader.fields.size();
  if (operations_ > kMaximumOperations)
    return "the type has more than 20000 fields, those of the types in it included";
  if (const char* wrong = number_fields(reader.fields)) return wrong;

  section.height = 1;
  auto nested = reader.nested.begin();
  for (PlannedField& each : reader.fields) {
    if (each.cdr != CdrForm::Message) continue;
    const Section* part;
    if (const char* wrong = add(*nested++, depth + 1, &part)) return wrong;
    each.message = part->message;
    section.height = std::max(section.height, part->height + 1);
  }
  if (section.height > kMaximumDepth) return "messages are nested more than 100 deep";
  section.message = static_cast<uint32_t>(messages_.size());
  section.state = Section::State::Planned;
  messages_.push_back(
      {joined(section.type, "/", "/"), joined(section.type, ".", ".pb."), std::move(reader.fields)});
  return nullptr;
}

const char* read(std::string_view text, std::string_view type_name, std::vector<uint8_t>* packed_plan) {
  constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
  TypeName type;
  if (!read_type_name(type_name, &type)) return "the type does not have a name such as sensor_msgs/msg/Imu";
  if (text.size() > kMaximumSchemaSize) return "the text has more than 4194304 bytes";
  if (starts_with(text, kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  Sections sections;
  if (const char* wrong = sections.read(text, type)) return wrong;
  if (sections.find(type) == nullptr) return "the text does not define the type";
  Planner planner(sections);
  const Section* root;
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
