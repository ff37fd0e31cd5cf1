#include "rosidl_adapter_proto/plan.hpp"

#include <algorithm>
#include <cstring>
#include <exception>
#include <numeric>

#include "heap_sort.hpp"
#include "rosidl_adapter_proto/wire.hpp"
#include "text.hpp"

namespace rosidl_proto {
namespace {

constexpr const char* kLargeMessage = "a message of this type is larger than 2 GiB";

// Sizes past what a message can have are all alike; stopping there keeps the arithmetic from overflowing.
constexpr uint64_t kTooLarge = uint64_t{1} << 40;

uint64_t saturate(uint64_t value) { return std::min(value, kTooLarge); }

uint64_t times(uint64_t a, uint64_t count) {
  return a != 0 && count > kTooLarge / a ? kTooLarge : saturate(a * count);
}

Advance then(const Advance& first, const Advance& second) {
  Advance both{};
  for (uint64_t i = 0; i < 8; ++i) both.by[i] = saturate(first.by[i] + second.from(i + first.by[i]));
  return both;
}

Advance repeat(const Advance& one, uint32_t count) {
  Advance all{};
  for (uint64_t i = 0; i < 8; ++i) {
    all.by[i] = saturate(one.from(i) + times(one.from(i + one.from(i)), count - 1));
  }
  return all;
}

Advance constant(uint64_t size) {
  Advance result{};
  std::fill(result.by, result.by + 8, size);
  return result;
}

Advance number(uint64_t size) {
  Advance result{};
  for (uint64_t i = 0; i < 8; ++i) result.by[i] = (align(i, size) - i) + size;
  return result;
}

// What the elements of a field need in CDR.
struct Extent {
  Advance usual, full;  // of the default value, and of the largest one
  uint64_t minimum;     // without alignment
  uint64_t ros1_minimum;
  bool fixed;          // all values need the same
  uint64_t alignment;  // of a number; the fields of a message have their own
};

Extent element_extent(const Operation& op, const std::vector<Message>& messages) {
  return visit(op.cdr, [&](auto form) -> Extent {
    using F = decltype(form);
    if constexpr (F::kIsNumber) {
      const Advance advance = number(F::kSize);
      return {advance, advance, F::kMinimumSize, F::kMinimumSize, true, F::kSize};
    } else if constexpr (F::kIsString) {
      const Advance empty = then(number(4), constant(F::kTerminator * F::kUnitSize));
      // As rmw_fastrtps estimates it: one unit for each character, and one more.
      const uint64_t most =
          op.string_bound == kUnbounded ? kTooLarge : (uint64_t{op.string_bound} + 1) * F::kUnitSize;
      return {empty, then(number(4), constant(most)), F::kMinimumSize, F::kMinimumSize, false, 1};
    } else {
      const Message& part = messages[op.message];
      return {part.default_size, part.full_size, part.minimum_size, part.ros1_minimum_size, part.fixed, 1};
    }
  });
}

Extent extent(const Operation& op, const std::vector<Message>& messages) {
  Extent one = element_extent(op, messages);
  switch (op.shape) {
    case Shape::Single:
      break;
    case Shape::Array:
      one.usual = repeat(one.usual, op.count);
      one.full = repeat(one.full, op.count);
      one.minimum = times(one.minimum, op.count);
      one.ros1_minimum = times(one.ros1_minimum, op.count);
      break;
    case Shape::Sequence: {
      const bool bounded = op.count != kUnbounded;
      one.usual = number(4);
      one.full = then(one.usual, !bounded        ? constant(kTooLarge)
                                 : op.count == 0 ? constant(0)
                                                 : repeat(one.full, op.count));
      one.minimum = one.ros1_minimum = 4;
      one.fixed = false;
      break;
    }
  }
  return one;
}

bool is_form(uint8_t number) {
  switch (static_cast<CdrForm>(number)) {
#define ROSIDL_PROTO_FORM(name, number) case CdrForm::name:
    ROSIDL_PROTO_CDR_FORMS(ROSIDL_PROTO_FORM)
#undef ROSIDL_PROTO_FORM
    return true;
  }
  return false;
}

// Fills in what follows from the forms; returns whether they go together.
bool derive_forms(Operation& op) {
  return visit(op.cdr, [&op](auto form) {
    using F = decltype(form);
    const bool many = op.shape != Shape::Single;
    const ProtobufForm expected = many ? F::kMany : F::kSingle;
    op.wire_type = wire_type_of(expected);
    op.packable = many && op.wire_type != WireType::Delimited;
    if (op.protobuf == ProtobufForm::None) {
      op.reading = Reading::Skip;
      return op.number == 0;
    }
    op.reading = many ? Reading::Many : Reading::One;
    return op.protobuf == expected && op.number != 0;
  });
}

void derive_tag(Operation& op) {
  if (op.protobuf == ProtobufForm::None) {  // no tag is like it
    op.tag_size = 0;
    op.tag = 1;
    op.tag_mask = 0;
    return;
  }
  const WireType written = op.packable ? WireType::Delimited : op.wire_type;
  uint8_t bytes[8] = {};
  op.tag_size = static_cast<uint8_t>(
      put_varint(bytes, uint64_t{op.number} << 3 | static_cast<uint8_t>(written)) - bytes);
  op.tag = load_little<uint64_t>(bytes);
  op.tag_mask = (uint64_t{1} << (8 * op.tag_size)) - 1;
}

// Reads the numbers of a packed plan one after the other.
class Words {
 public:
  explicit Words(const uint8_t* data) : data_(data) {}
  uint8_t byte() { return *data_++; }
  uint32_t word() {
    data_ += 4;
    return load_little<uint32_t>(data_ - 4);
  }
  Name name() {
    const uint32_t place = word();
    return {place, word()};
  }

 private:
  const uint8_t* data_;
};

const char* read_operation(const uint8_t* data, Operation& op) {
  Words words(data);
  op = {};
  op.scalar = words.byte();
  const uint8_t cdr = words.byte();
  op.protobuf = static_cast<ProtobufForm>(words.byte());
  const uint8_t shape = words.byte(), omit_empty = words.byte();
  const bool reserved = (words.byte() | words.byte() | words.byte()) != 0;
  if (!is_form(cdr) || shape >= kShapes || omit_empty > 1 || reserved)
    return "the plan has an unknown operation";
  op.cdr = static_cast<CdrForm>(cdr);
  op.shape = static_cast<Shape>(shape);
  op.omit_empty = omit_empty != 0;
  op.number = words.word();
  op.count = words.word();
  op.string_bound = words.word();
  op.message = words.word();
  op.name = words.name();
  op.protobuf_name = words.name();
  if (op.number > kMaximumFieldNumber) return "the plan has a field number out of range";
  if (op.shape == Shape::Array && op.count == 0) return "the plan has an array of no length";
  if (op.shape == Shape::Array && op.count > kMaximumSize) return kLargeMessage;
  if (!derive_forms(op)) return "the plan has a field whose forms do not go together";
  derive_tag(op);
  return nullptr;
}

}  // namespace

const char* Plan::load(const uint8_t* data, size_t size) noexcept {
  try {
    const char* wrong = read(data, size);
    return wrong ? wrong : derive();
  } catch (const std::exception&) {
    return "there is not enough memory for the plan";
  }
}

const char* Plan::read(const uint8_t* data, size_t size) {
  if (size < kPlanHeaderBytes || std::memcmp(data, kPlanMark, sizeof kPlanMark - 1) != 0)
    return "the plan does not begin as a plan does";
  if (data[3] != static_cast<uint8_t>(kPlanMark[3])) {
    return "the plan has another version than this core, which reads version 2; build it again";
  }
  Words header(data + sizeof kPlanMark);
  const uint64_t messages = header.word(), operations = header.word(), names = header.word();
  const uint32_t partial = header.word();
  if (size != kPlanHeaderBytes + messages * kPlanMessageBytes + operations * kPlanOperationBytes + names ||
      messages == 0) {
    return "the plan does not have the size that it names";
  }
  if (partial > 1) return "the plan has an unknown property";
  partial_ = partial != 0;
  const uint8_t* p = data + kPlanHeaderBytes;
  names_.assign(reinterpret_cast<const char*>(data + size - names), names);
  const auto is_name = [this](Name name) {
    return uint64_t{name.place} + name.size <= names_.size() &&
           is_utf8(reinterpret_cast<const uint8_t*>(names_.data()) + name.place, name.size);
  };
  messages_.resize(messages);
  uint64_t first = 0;
  for (Message& message : messages_) {
    Words words(p);
    message.first = words.word();
    message.count = words.word();
    message.name = words.name();
    message.protobuf_name = words.name();
    if (message.first != first || message.count == 0)
      return "the messages of the plan do not follow each other";
    if (!is_name(message.name) || !is_name(message.protobuf_name))
      return "the plan has a name that is not among its names";
    first += message.count;
    p += kPlanMessageBytes;
  }
  if (first != operations) return "the messages of the plan do not cover its operations";
  operations_.resize(operations);
  for (Operation& op : operations_) {
    if (const char* wrong = read_operation(p, op)) return wrong;
    if (!is_name(op.name) || !is_name(op.protobuf_name))
      return "the plan has a name that is not among its names";
    p += kPlanOperationBytes;
  }
  return nullptr;
}

const char* Plan::derive() {
  by_number_.resize(operations_.size());
  std::iota(by_number_.begin(), by_number_.end(), 0u);
  std::vector<uint32_t> depths(messages_.size(), 1);
  // A message may only contain later ones: so none contains itself, and going backwards finds the parts
  // first.
  for (size_t i = messages_.size(); i-- > 0;) {
    Message& message = messages_[i];
    for (uint32_t j = message.first; j < message.first + message.count; ++j) {
      const Operation& op = operations_[j];
      if (op.cdr != CdrForm::Message) continue;
      if (op.message <= i || op.message >= messages_.size())
        return "the plan nests its messages in the wrong order";
      depths[i] = std::max(depths[i], depths[op.message] + 1);
    }
    if (depths[i] > kMaximumDepth) return "the messages of the plan are nested too deeply";
    if (const char* wrong = derive(message)) return wrong;
  }
  return nullptr;
}

// ROS 1 has unsigned seconds in a time, and signed nanoseconds in a duration
// (https://wiki.ros.org/msg#Field_Types); ROS 2 has it the other way round.
void Plan::derive_ros1(const Message& message, Operation& op) const {
  const std::string type = text(message.name), field = text(op.name);
  op.filler = field == "structure_needs_at_least_one_member" && op.protobuf == ProtobufForm::None;
  op.other_sign =
      (type == "builtin_interfaces/msg/Time" && field == "sec" && op.cdr == CdrForm::Int32) ||
      (type == "builtin_interfaces/msg/Duration" && field == "nanosec" && op.cdr == CdrForm::Uint32);
}

const char* Plan::derive(Message& message) {
  uint32_t deepest = 0;
  message.fixed = true;
  message.default_size = message.full_size = constant(0);
  for (uint32_t j = message.first; j < message.first + message.count; ++j) {
    Operation& op = operations_[j];
    const Extent field = extent(op, messages_);
    if (op.cdr == CdrForm::Message) deepest = std::max(deepest, messages_[op.message].slots);
    for (uint64_t i = 0; i < 8; ++i) {
      const uint64_t place = i + message.default_size.by[i];
      op.place[i] = static_cast<uint32_t>(std::min(align(place, field.alignment) - i, kMaximumSize));
    }
    message.default_size = then(message.default_size, field.usual);
    message.full_size = then(message.full_size, field.full);
    message.minimum_size = saturate(message.minimum_size + field.minimum);
    derive_ros1(message, op);
    if (!op.filler) message.ros1_minimum_size = saturate(message.ros1_minimum_size + field.ros1_minimum);
    message.fixed = message.fixed && field.fixed;
  }
  const Advance& whole = message.default_size;
  if (*std::max_element(whole.by, whole.by + 8) > kMaximumSize) return kLargeMessage;
  if (uint64_t{message.count} + deepest > kUnbounded) return "the plan has too many operations";
  message.slots = message.count + deepest;
  return order(message);
}

// Links the operations in the order of their field numbers; those that have none come first and are left out.
const char* Plan::order(Message& message) {
  const auto first = by_number_.begin() + message.first, last = first + message.count;
  heap_sort(first, last,
            [this](uint32_t a, uint32_t b) { return operations_[a].number < operations_[b].number; });
  auto numbered =
      std::find_if(first, last, [this](uint32_t index) { return operations_[index].number != 0; });
  if (numbered == last) numbered = first;
  message.lowest = *numbered;
  for (auto it = numbered; it != last; ++it) {
    const auto following = it + 1 == last ? numbered : it + 1;
    operations_[*it].next = *following;
    if (following != numbered && operations_[*following].number == operations_[*it].number &&
        operations_[*it].number != 0) {
      return "the plan gives one field number to two fields";
    }
  }
  return nullptr;
}

const Operation* Plan::find(const Message& message, uint32_t number) const {
  const uint32_t* from = by_number_.data() + message.first;
  const uint32_t* to = from + message.count;
  const uint32_t* found = std::lower_bound(from, to, number, [this](uint32_t index, uint32_t wanted) {
    return operations_[index].number < wanted;
  });
  return found != to && operations_[*found].number == number ? &operations_[*found] : nullptr;
}

}  // namespace rosidl_proto
