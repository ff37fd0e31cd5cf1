#include "plan.hpp"

#include <algorithm>
#include <cstring>
#include <new>
#include <numeric>

#include "bytes.hpp"
#include "text.hpp"

namespace rosidl_proto {
namespace {

constexpr uint32_t kMagic = 0x31505052;  // "RPP1"
constexpr size_t kHeaderBytes = 16, kMessageBytes = 8, kOperationBytes = 28;
constexpr uint32_t kMaximumFieldNumber = (1u << 29) - 1;

// Size of an element in CDR; 0 for those whose size varies. The alignment of a number is its size (CORBA 3.3
// part 2, section 9.3.1).
constexpr uint8_t kElementSize[kKinds] = {1, 1, 1, 1, 1, 2, 2, 2, 4, 8, 0, 0, 0};

constexpr WireType kWireType[kKinds] = {
    WireType::Varint,    WireType::Varint,    WireType::Varint,   WireType::Varint,  WireType::Varint,
    WireType::Varint,    WireType::Varint,    WireType::Varint,   WireType::Fixed32, WireType::Fixed64,
    WireType::Delimited, WireType::Delimited, WireType::Delimited};

constexpr bool kTextOrBytes[kKinds] = {false, false, true,  true,  true,  false, false,
                                       true,  false, false, false, false, false};

// Sizes past what a message can have are all alike; stopping there keeps the arithmetic from overflowing.
constexpr uint64_t kTooLarge = uint64_t{1} << 40;

uint64_t saturate(uint64_t value) { return std::min(value, kTooLarge); }

uint64_t times(uint64_t a, uint64_t count) {
  return a != 0 && count > kTooLarge / a ? kTooLarge : saturate(a * count);
}

// How far a value moves an offset, for each offset modulo 8.
struct Advance {
  uint64_t by[8];
};

Advance then(const Advance& first, const Advance& second) {
  Advance both;
  for (int i = 0; i < 8; ++i) both.by[i] = saturate(first.by[i] + second.by[(i + first.by[i]) & 7]);
  return both;
}

Advance repeat(Advance one, uint32_t count) {
  Advance all{};
  for (; count != 0; count >>= 1) {
    if (count & 1) all = then(all, one);
    one = then(one, one);
  }
  return all;
}

Advance constant(uint64_t size) {
  Advance result;
  std::fill(result.by, result.by + 8, size);
  return result;
}

// A string and its end, as rmw_fastrtps estimates it: one byte or wide character for each character.
Advance bytes_up_to(uint32_t bound, uint64_t size) {
  return constant(bound == kUnbounded ? kTooLarge : (uint64_t{bound} + 1) * size);
}

Advance number(uint64_t size) {
  Advance result;
  for (uint64_t i = 0; i < 8; ++i) result.by[i] = (align(i, size) - i) + size;
  return result;
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
  if (size < kHeaderBytes || load_little<uint32_t>(data) != kMagic)
    return "the plan does not begin as a plan does";
  const uint64_t messages = load_little<uint32_t>(data + 4);
  const uint64_t operations = load_little<uint32_t>(data + 8);
  const uint64_t names = load_little<uint32_t>(data + 12);
  if (size != kHeaderBytes + messages * kMessageBytes + operations * kOperationBytes + names ||
      messages == 0) {
    return "the plan does not have the size that it names";
  }
  const uint8_t* p = data + kHeaderBytes;
  messages_.resize(messages);
  uint64_t first = 0;
  for (Message& message : messages_) {
    message.first = load_little<uint32_t>(p);
    message.count = load_little<uint32_t>(p + 4);
    if (message.first != first || message.count == 0)
      return "the messages of the plan do not follow each other";
    first += message.count;
    p += kMessageBytes;
  }
  if (first != operations) return "the messages of the plan do not cover its operations";
  operations_.resize(operations);
  for (Operation& op : operations_) {
    const uint32_t number = load_little<uint32_t>(p + 4);
    if (p[0] >= kKinds || p[1] >= kShapes || p[2] > 1) return "the plan has an unknown operation";
    if (number == 0 || number > kMaximumFieldNumber) return "the plan has a field number out of range";
    op.kind = static_cast<Kind>(p[0]);
    op.shape = static_cast<Shape>(p[1]);
    op.omit_empty = p[2] != 0;
    op.number = number;
    op.count = load_little<uint32_t>(p + 8);
    op.string_bound = load_little<uint32_t>(p + 12);
    op.message = load_little<uint32_t>(p + 16);
    op.name = load_little<uint32_t>(p + 20);
    op.name_size = load_little<uint32_t>(p + 24);
    if (uint64_t{op.name} + op.name_size > names) return "the plan names a field outside of its names";
    if (op.shape == Shape::Array && (op.count == 0 || op.count > kMaximumSize))
      return "the plan has an array of no length";
    if (op.kind == Kind::Placeholder && op.shape != Shape::Single) return "the plan repeats a placeholder";
    p += kOperationBytes;
  }
  for (const Operation& op : operations_) {
    if (!is_utf8(p + op.name, op.name_size)) return "the plan has a name that is not UTF-8";
  }
  names_.assign(reinterpret_cast<const char*>(p), names);
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
      if (op.kind != Kind::Message) continue;
      if (op.message <= i || op.message >= messages_.size())
        return "the plan nests its messages in the wrong order";
      depths[i] = std::max(depths[i], depths[op.message] + 1);
    }
    if (depths[i] > kMaximumDepth) return "the messages of the plan are nested too deeply";
    if (const char* wrong = derive(message)) return wrong;
  }
  return nullptr;
}

const char* Plan::derive(Message& message) {
  Advance whole{}, whole_full{};
  uint32_t deepest = 0;
  message.fixed = true;
  for (uint32_t j = message.first; j < message.first + message.count; ++j) {
    Operation& op = operations_[j];
    const size_t kind = static_cast<size_t>(op.kind);
    const bool many = op.shape != Shape::Single;
    op.packable = many && !kTextOrBytes[kind] && kWireType[kind] != WireType::Delimited;
    op.wire_type = many && kTextOrBytes[kind] ? WireType::Delimited : kWireType[kind];
    const WireType written = op.packable ? WireType::Delimited : op.wire_type;
    uint64_t tag = uint64_t{op.number} << 3 | static_cast<uint8_t>(written);
    uint8_t bytes[8] = {};
    op.tag_size = static_cast<uint8_t>(put_varint(bytes, tag) - bytes);
    op.tag = load_little<uint64_t>(bytes);
    op.tag_mask = (uint64_t{1} << (8 * op.tag_size)) - 1;

    Advance one, full;
    uint64_t minimum;
    bool fixed = true;
    if (op.kind == Kind::Message) {
      const Message& part = messages_[op.message];
      std::copy(part.default_size, part.default_size + 8, one.by);
      std::copy(part.full_size, part.full_size + 8, full.by);
      minimum = part.minimum_size;
      fixed = part.fixed;
      deepest = std::max(deepest, part.slots);
    } else if (op.kind == Kind::String) {
      one = then(number(4), number(1));
      full = then(number(4), bytes_up_to(op.string_bound, 1));
      minimum = 4;
      fixed = false;
    } else if (op.kind == Kind::Wstring) {
      one = number(4);
      full = then(number(4), bytes_up_to(op.string_bound, 4));
      minimum = 4;
      fixed = false;
    } else {
      one = full = number(kElementSize[kind]);
      minimum = kElementSize[kind];
    }
    if (op.shape == Shape::Array) {
      one = repeat(one, op.count);
      full = repeat(full, op.count);
      minimum = times(minimum, op.count);
    } else if (op.shape == Shape::Sequence) {
      one = number(4);
      full = then(one, op.count == kUnbounded ? constant(kTooLarge) : repeat(full, op.count));
      minimum = 4;
      fixed = false;
    }
    for (uint64_t i = 0; i < 8; ++i) {
      // Only numbers have an alignment, arrays that of their elements.
      const uint64_t place = i + whole.by[i], size = std::max<uint64_t>(1, kElementSize[kind]);
      op.place[i] = static_cast<uint32_t>(std::min(align(place, size) - i, kMaximumSize));
    }
    whole = then(whole, one);
    whole_full = then(whole_full, full);
    message.minimum_size = saturate(message.minimum_size + minimum);
    message.fixed = message.fixed && fixed;
  }
  std::copy(whole.by, whole.by + 8, message.default_size);
  std::copy(whole_full.by, whole_full.by + 8, message.full_size);
  if (*std::max_element(whole.by, whole.by + 8) > kMaximumSize)
    return "a message of this type is larger than 2 GiB";
  if (uint64_t{message.count} + deepest > kUnbounded) return "the plan has too many operations";
  message.slots = message.count + deepest;

  const auto from = by_number_.begin() + message.first, to = from + message.count;
  std::sort(from, to,
            [this](uint32_t a, uint32_t b) { return operations_[a].number < operations_[b].number; });
  message.lowest = *from;
  for (auto it = from; it != to; ++it) {
    const auto following = it + 1 == to ? from : it + 1;
    if (following != from && operations_[*following].number == operations_[*it].number) {
      return "the plan gives one field number to two fields";
    }
    operations_[*it].next = *following;
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

std::string Plan::name(uint32_t operation) const {
  const Operation& op = operations_[operation];
  return names_.substr(op.name, op.name_size);
}

}  // namespace rosidl_proto
