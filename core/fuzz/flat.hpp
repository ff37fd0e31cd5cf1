// Flat pairs under the fuzzer.
#pragma once

#include <memory>

#include "rosidl_adapter_proto/flat.hpp"
#include "rosidl_adapter_proto/wire.hpp"

// Reads pairs of a format to the end; what is wrong goes to `check`.
template <class Check>
class FuzzPairs {
 public:
  FuzzPairs(rosidl_proto::FlatFormat format, const uint8_t* data, uint64_t size, uint64_t message_size,
            Check check)
      : format_(format), data_(data), size_(size), message_size_(message_size), check_(check) {}

  void read() {
    const bool module = format_ == rosidl_proto::FlatFormat::Module;
    if (module) take(20);
    auto count = number<uint32_t>();
    for (; count > 0; --count) module ? module_pair() : pair();
    check_(place_ + names_ == size_, "pairs have another size than they say");
  }

 private:
  void pair() {
    take(text_size());
    const auto type = number<uint8_t>();
    if (type == 18) {
      take(text_size());
    } else if (type == 19) {
      const uint64_t offset = number<uint32_t>();
      check_(offset + number<uint32_t>() <= message_size_, "a blob lies outside of its message");
    } else {
      const bool known = type < 4 || (type >= 8 && type < 12) || type == 16 || type == 17 || type == 20;
      check_(known, "a pair has an unknown type");
      take(type == 20 ? 1 : type >= 16 ? uint64_t{4} << (type & 1) : uint64_t{1} << (type & 3));
    }
  }

  void module_pair() {
    const uint64_t offset = number<uint32_t>(), length = number<uint32_t>();
    check_(offset + length <= size_, "a name lies outside of the pairs");
    names_ += length;
    const auto kind = number<uint8_t>();
    check_(kind <= 4, "a pair has an unknown kind");
    take(kind == 4 ? number<uint32_t>() : kind == 3 ? 1 : 8);
  }

  uint64_t text_size() {
    return format_ == rosidl_proto::FlatFormat::Page ? number<uint16_t>() : number<uint32_t>();
  }

  template <class T>
  T number() {
    take(sizeof(T));
    return rosidl_proto::load_little<T>(data_ + place_ - sizeof(T));
  }

  void take(uint64_t size) {
    check_(size <= size_ - place_, "pairs are cut off");
    place_ += size;
  }

  const rosidl_proto::FlatFormat format_;
  const uint8_t* const data_;
  const uint64_t size_, message_size_;
  Check check_;
  uint64_t place_ = 0, names_ = 0;
};

// Notes for what looks like it: a map has entries of a key and a value, and every int32 is an enumeration.
inline rosidl_proto::FlatNotes fuzz_notes(const rosidl_proto::Plan& plan) {
  using namespace rosidl_proto;
  FlatNotes notes(plan.operation_count());
  for (uint32_t i = 0; i < notes.size(); ++i) {
    const Operation& op = plan.operation(i);
    if (op.cdr == CdrForm::Varint32) notes[i].enum_values = {{-1, "NONE"}, {0, "RED"}, {5, "BLUE"}};
    if (op.cdr != CdrForm::Message || op.shape != Shape::Sequence) continue;
    const Message& part = plan.message(op.message);
    const Operation& key = *plan.begin(part);
    const bool integer = visit(key.cdr, [](auto form) { return decltype(form)::kIsNumber; }) &&
                         key.cdr != CdrForm::Float && key.cdr != CdrForm::Double;
    notes[i].map = part.count == 2 && plan.text(key.name) == "key" && key.shape == Shape::Single &&
                   (integer || key.cdr == CdrForm::String);
    notes[i].single = !notes[i].map && op.count == 1;
  }
  return notes;
}

// Makes pairs of a message in a format, into all the room they take and into less.
template <class Check>
void fuzz_flat(const rosidl_proto::Plan& plan, rosidl_proto::Input message, Check check) {
  using namespace rosidl_proto;
  constexpr uint64_t kRoom = 1 << 16;
  const uint8_t seed = message.size == 0 ? 0 : message.data[message.size / 2];
  const auto format = static_cast<FlatFormat>(seed % 3);
  Flattener flattener;
  if (flattener.load(plan, fuzz_notes(plan), format) != nullptr) return;  // a path may be too long
  flattener.set_array_policy({(seed & 1) != 0, seed % 8u});
  for (const Serialization each : {Serialization::Cdr, Serialization::Protobuf, Serialization::Ros1}) {
    uint64_t room = kRoom;
    for (int i = 0; i < 3; ++i) {
      const std::unique_ptr<uint8_t[]> output(new uint8_t[room]);
      Error error;
      const uint64_t size = flattener.flatten(each, message, {output.get(), room}, error);
      check(size <= room, "pairs pass the end of the output");
      check((size == 0) == (error.reason != Reason::None), "pairs and an error, or neither");
      check(error.offset <= message.size, "an error of pairs lies outside of the input");
      if (size == 0) break;
      FuzzPairs<Check>(format, output.get(), size, message.size, check).read();
      room = i == 0 ? size : size * seed / 256;
    }
  }
}
