#include "packed_plan.hpp"

#include <algorithm>

#include "rosidl_adapter_proto/wire.hpp"

namespace rosidl_proto {

const char* const kTooManyFields = "the type has more than 20000 fields, those of the types in it included";
const char* const kTooManyValues = "the enums of the type have more than 100000 values";

namespace {

// All names of a plan, each of them once.
class Names {
 public:
  // So many names will be added at most.
  explicit Names(size_t most) {
    size_t slots = 1;
    while (slots < 2 * most) slots *= 2;
    slots_.resize(slots);
  }

  Name add(std::string_view name) {
    uint32_t hash = 2166136261;  // FNV-1a
    for (const char each : name) hash = (hash ^ static_cast<uint8_t>(each)) * 16777619;
    for (size_t i = hash;; ++i) {
      Slot& slot = slots_[i & (slots_.size() - 1)];
      if (!slot.used) {
        slot = {{static_cast<uint32_t>(text_.size()), static_cast<uint32_t>(name.size())}, true};
        text_ += name;
      }
      const std::string_view known(text_.data() + slot.name.place, slot.name.size);
      if (known == name) return slot.name;
    }
  }

  const std::string& text() const { return text_; }

 private:
  struct Slot {
    Name name;
    bool used;
  };

  std::string text_;
  std::vector<Slot> slots_;  // a hash table with open addresses
};

// Writes a packed plan from front to back.
class Writer {
 public:
  explicit Writer(uint8_t* place) : place_(place) {}

  void byte(uint8_t value) { *place_++ = value; }
  void word(uint32_t value) {
    store_little(place_, value);
    place_ += sizeof value;
  }
  void name(Name name) {
    word(name.place);
    word(name.size);
  }

  void field(const PlannedField& field, uint32_t message, Names& names) {
    byte(field.scalar);
    byte(static_cast<uint8_t>(field.cdr));
    byte(static_cast<uint8_t>(field.protobuf));
    byte(static_cast<uint8_t>(field.shape));
    word(0);  // empty messages are not left out; and three bytes of nothing
    word(field.number);
    word(field.count);
    word(field.string_bound);
    word(message);
    name(names.add(field.name));
    name(names.add(field.protobuf == ProtobufForm::None ? std::string_view() : field.name));
  }

 private:
  uint8_t* place_;
};

}  // namespace

ProtobufForm protobuf_form(CdrForm cdr, Shape shape) {
  return visit(cdr, [shape](auto form) {
    using F = decltype(form);
    return shape == Shape::Single ? F::kSingle : F::kMany;
  });
}

std::vector<uint8_t> pack_plan(const std::vector<PlannedMessage>& messages) {
  size_t operations = 0;
  for (const PlannedMessage& each : messages) operations += each.fields.size();
  const size_t operations_place = kPlanHeaderBytes + messages.size() * kPlanMessageBytes;
  std::vector<uint8_t> packed(operations_place + operations * kPlanOperationBytes);
  Names names(2 * (messages.size() + operations));

  const auto last = static_cast<uint32_t>(messages.size() - 1);
  Writer message_writer(packed.data() + kPlanHeaderBytes), field_writer(packed.data() + operations_place);
  uint32_t first = 0;
  for (auto message = messages.rbegin(); message != messages.rend(); ++message) {
    const auto count = static_cast<uint32_t>(message->fields.size());
    message_writer.word(first);
    message_writer.word(count);
    message_writer.name(names.add(message->name));
    message_writer.name(names.add(message->protobuf_name));
    for (const PlannedField& each : message->fields) {
      field_writer.field(each, each.cdr == CdrForm::Message ? last - each.message : 0, names);
    }
    first += count;
  }

  std::copy(kPlanMark, kPlanMark + sizeof kPlanMark, packed.begin());
  Writer header(packed.data() + sizeof kPlanMark);
  header.word(static_cast<uint32_t>(messages.size()));
  header.word(first);
  header.word(static_cast<uint32_t>(names.text().size()));
  header.word(0);  // no fields are missing
  packed.insert(packed.end(), names.text().begin(), names.text().end());
  return packed;
}

}  // namespace rosidl_proto
