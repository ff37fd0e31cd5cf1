#include "rosidl_adapter_proto/flat.hpp"

#include <exception>

#include "flat_sink.hpp"
#include "read_message.hpp"

namespace rosidl_proto {
namespace {

constexpr const char* kNoMemory = "there is not enough memory for a flattener";
constexpr const char* kWrongNotes = "the notes are not those of the plan";

constexpr uint64_t kLongestIndices = 24;  // [4294967295][4294967295]

bool is_number(CdrForm form) {
  return visit(form, [](auto each) { return decltype(each)::kIsNumber; });
}

bool is_map_key(const Operation& op) {
  const bool integer = is_number(op.cdr) && module_kind(builtin_type(op.cdr)) != ModuleKind::Float64;
  return op.shape == Shape::Single && (integer || op.cdr == CdrForm::String);
}

}  // namespace

const char* Flattener::load(Plan plan, FlatNotes notes, FlatFormat format) noexcept {
  try {
    plan_ = std::move(plan);
    notes_ = std::move(notes);
    format_ = format;
    return read();
  } catch (const std::exception&) {
    return kNoMemory;
  }
}

const char* Flattener::read() {
  fields_ = std::make_unique<Fields>(plan_);
  if (fields_->slots() == nullptr) return kNoMemory;
  const std::string& names = plan_.names();
  names_.assign(names.begin(), names.end());
  names_.resize(names.size() + kSpill);
  shown_.resize(plan_.operation_count());
  if (!notes_.empty() && notes_.size() != shown_.size()) return kWrongNotes;
  for (size_t i = 0; i < shown_.size(); ++i) shown_[i].name = plan_.operation(static_cast<uint32_t>(i)).name;
  for (uint32_t i = 0; i < shown_.size(); ++i) {
    if (const char* wrong = add(plan_.operation(i), shown_[i])) return wrong;
  }
  return measure_paths();
}

const char* Flattener::add(const Operation& op, FlatField& field) {
  const FlatNote none;
  const size_t index = static_cast<size_t>(&field - shown_.data());
  const FlatNote& note = notes_.empty() ? none : notes_[index];
  const bool many = op.shape != Shape::Single;
  if ((note.map || note.single) && (!many || op.cdr != CdrForm::Message)) return kWrongNotes;
  field.single = note.single;
  field.indexed = many && !note.map && !note.single;
  if (!note.enum_values.empty() && !is_number(op.cdr)) return kWrongNotes;
  if (!note.enum_values.empty()) field.names = &notes_[index].enum_values;
  return note.map ? add_map(op) : nullptr;
}

// The entries of a map have two fields: the key and the value.
const char* Flattener::add_map(const Operation& op) {
  const Message& entry = plan_.message(op.message);
  if (entry.count != 2 || !is_map_key(*plan_.begin(entry))) return kWrongNotes;
  shown_[entry.first].map_key = true;
  shown_[entry.first + 1].name = {0, 0};
  return nullptr;
}

// Takes the room for the longest path. Messages only contain later ones.
const char* Flattener::measure_paths() {
  std::vector<uint64_t> longest(plan_.message_count());
  for (uint32_t i = plan_.message_count(); i-- > 0;) {
    const Message& message = plan_.message(i);
    uint64_t keys = 0;
    for (uint32_t j = message.first; j < message.first + message.count; ++j) {
      const Operation& op = plan_.operation(j);
      const uint64_t inside = op.cdr == CdrForm::Message ? 1 + longest[op.message] : 0;
      if (shown_[j].map_key) keys = kMaximumMapKey;
      longest[i] = std::max(longest[i], shown_[j].name.size + kLongestIndices + inside);
    }
    longest[i] += keys;
    if (longest[i] >= kMaximumFlatKey)
      return "the path of a field is longer than 65,535 bytes; shorten its names";
  }
  path_.resize(static_cast<size_t>(1 + longest[0] + kSpill));
  path_[0] = '/';
  return nullptr;
}

uint64_t Flattener::flatten(Serialization serialization, Input message, Output output,
                            Error& error) noexcept {
  FlatPairs pairs(format_, output);
  uint8_t* at = pairs.begin();
  if (at == nullptr) {
    error.reason = Reason::TooLarge;
    error.a = output.size;
    return 0;
  }
  const FlatSink::Setting setting{&plan_.operation(0),
                                  shown_.data(),
                                  names_.data(),
                                  path_.data(),
                                  format_ == FlatFormat::Module ? 0u : 1u,
                                  policy_,
                                  message};
  if (!read_message(plan_, serialization, message, FlatSink(setting, pairs), *fields_, &at, error)) return 0;
  return pairs.finish(at);
}

}  // namespace rosidl_proto
