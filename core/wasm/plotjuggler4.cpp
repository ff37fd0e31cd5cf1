// PlotJuggler 4: version 1 of its ABI of parser modules, which no release loads from WebAssembly yet.
// Addresses, sizes and instances have 64 bits there; what is handed over lies in blocks of little-endian
// numbers.
#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "encoding.hpp"
#include "memory.hpp"
#include "plugin.hpp"
#include "rosidl_adapter_proto/wire.hpp"

namespace rosidl_proto::plugin {
namespace {

enum class Answer : int32_t {
  Good = 0,
  Declined = 1,
  Failed = -1,
  NoInstance = -2,
  Malformed = -3,
  NoClaim = -4,
  NoMemory = -5,
};

constexpr uint64_t kMaximumErrorText = 512;

// Stands for what the error of the message says.
constexpr const char* kBadMessage = "the message is not valid";

// What was wrong where there was no instance to tell.
const char* wrong_without_instance = "";

int32_t answer(Parser* parser, Answer answer, const char* wrong) {
  (parser == nullptr ? wrong_without_instance : parser->wrong) = wrong;
  return static_cast<int32_t>(answer);
}

const uint8_t* at(uint64_t address) {
  return reinterpret_cast<const uint8_t*>(static_cast<uintptr_t>(address));
}
uint8_t* writable_at(uint64_t address) { return reinterpret_cast<uint8_t*>(static_cast<uintptr_t>(address)); }

// What an instance is bound to.
struct Binding {
  static constexpr uint64_t kHeaderSize = 16, kTexts = 6, kSize = kHeaderSize + kTexts * 8;
  static constexpr uint16_t kVersion = 1, kScalarRoute = 1;
  enum Text { Encoding, TypeName, Schema };

  explicit Binding(uint64_t address) : data_(at(address)) {}

  uint16_t version() const { return load_little<uint16_t>(data_); }
  uint16_t route() const { return load_little<uint16_t>(data_ + 2); }
  uint32_t claim() const { return load_little<uint32_t>(data_ + 4); }
  uint32_t texts() const { return load_little<uint32_t>(data_ + 12); }

  // Returns whether all of a text lies in the first `size` bytes.
  bool text(Text index, uint64_t size, std::string_view* text) const {
    const uint8_t* const entry = data_ + kHeaderSize + index * 8;
    const uint64_t offset = load_little<uint32_t>(entry), length = load_little<uint32_t>(entry + 4);
    if (offset > size || length > size - offset) return false;
    *text = {reinterpret_cast<const char*>(data_ + offset), static_cast<size_t>(length)};
    return true;
  }

 private:
  const uint8_t* data_;
};

int32_t bind(Parser* parser, uint64_t address, uint64_t size) {
  if (!is_memory(address, size) || size < Binding::kSize)
    return answer(parser, Answer::Malformed, "the binding is not in the memory, or too short");
  const Binding binding(address);
  if (binding.version() != Binding::kVersion || binding.texts() < Binding::kTexts)
    return answer(parser, Answer::Malformed, "the binding is not one of version 1");
  if (binding.claim() != 0) return answer(parser, Answer::NoClaim, "the module has one claim");
  std::string_view encoding_name, type_name, schema;
  if (!binding.text(Binding::Encoding, size, &encoding_name) ||
      !binding.text(Binding::TypeName, size, &type_name) || !binding.text(Binding::Schema, size, &schema))
    return answer(parser, Answer::Malformed, "the binding has a text that is not in it");
  if (binding.route() != Binding::kScalarRoute || encoding_name != kEncoding)
    return answer(parser, Answer::Declined, "the module has scalars of one encoding only");
  if (const char* wrong = parser->load(type_name, schema))
    return answer(parser, wrong == kNoMemory ? Answer::NoMemory : Answer::Failed, wrong);
  if (!parser->output) {
    if (!have_memory(kOutputSize)) return answer(parser, Answer::NoMemory, kNoMemory);
    parser->output.reset(new uint8_t[kOutputSize]);
  }
  return answer(parser, Answer::Good, "");
}

// Before the bytes of a message are flags, a time and the number of the bytes.
constexpr uint64_t kMessageHeader = 24, kMessageSize = 16;
constexpr uint8_t kHasTime = 1;

int32_t parse(Parser* parser, uint64_t address, uint64_t size, uint64_t output_address,
              uint64_t output_size) {
  constexpr uint64_t kSlot = sizeof(uint64_t);
  if (!parser->output) return answer(parser, Answer::Failed, "the instance is not bound");
  if (!is_memory(address, size) || size < kMessageHeader || !is_memory(output_address, kSlot) ||
      !is_memory(output_size, kSlot))
    return answer(parser, Answer::Malformed, "the message is not in the memory, or too short");
  if ((*at(address) & ~kHasTime) != 0)
    return answer(parser, Answer::Malformed, "the message has unknown flags");
  const Input message{at(address + kMessageHeader), load_little<uint64_t>(at(address + kMessageSize))};
  if (message.size > size - kMessageHeader)
    return answer(parser, Answer::Malformed, "the message is longer than what it came in");
  const uint64_t written = parser->flatten(FlatFormat::Module, message, {parser->output.get(), kOutputSize});
  if (written == 0) return answer(parser, Answer::Failed, kBadMessage);
  store_little(writable_at(output_address), uint64_t{reinterpret_cast<uintptr_t>(parser->output.get())});
  store_little(writable_at(output_size), written);
  return answer(parser, Answer::Good, "");
}

}  // namespace

ROSIDL_PROTO_EXPORT(pj_module_abi) uint32_t pj_module_abi() { return 1; }

ROSIDL_PROTO_EXPORT(pj_module_create) uint64_t pj_module_create(uint32_t claim) {
  if (claim != 0) return answer(nullptr, Answer::Good, "the module has one claim"), 0;
  const uint32_t instance = add_parser();
  if (instance == 0) answer(nullptr, Answer::NoMemory, kNoMemory);
  return instance;
}

ROSIDL_PROTO_EXPORT(pj_module_destroy) void pj_module_destroy(uint64_t instance) { remove_parser(instance); }

ROSIDL_PROTO_EXPORT(pj_module_bind)
int32_t pj_module_bind(uint64_t instance, uint64_t address, uint64_t size) {
  Parser* const parser = find_parser(instance);
  if (parser == nullptr) return answer(nullptr, Answer::NoInstance, "there is no such instance");
  return bind(parser, address, size);
}

ROSIDL_PROTO_EXPORT(pj_module_parse)
int32_t pj_module_parse(uint64_t instance, uint64_t address, uint64_t size, uint64_t output_address,
                        uint64_t output_size) {
  Parser* const parser = find_parser(instance);
  if (parser == nullptr) return answer(nullptr, Answer::NoInstance, "there is no such instance");
  return parse(parser, address, size, output_address, output_size);
}

ROSIDL_PROTO_EXPORT(pj_module_last_error)
uint64_t pj_module_last_error(uint64_t instance, uint64_t address, uint64_t capacity) {
  if (!have_memory(kSomeMemory)) return 0;
  const Parser* const parser = find_parser(instance);
  std::string text = parser == nullptr ? wrong_without_instance : parser->wrong;
  if (parser != nullptr && parser->wrong == kBadMessage) text = reason(parser->error);
  const uint64_t size = std::min({uint64_t{text.size()}, capacity, kMaximumErrorText});
  if (!is_memory(address, size)) return 0;
  std::memcpy(writable_at(address), text.data(), static_cast<size_t>(size));
  return size;
}

ROSIDL_PROTO_EXPORT(pj_module_alloc) uint64_t pj_module_alloc(uint64_t size) {
  return size > SIZE_MAX / 2 ? 0 : reinterpret_cast<uintptr_t>(std::malloc(static_cast<size_t>(size)));
}

ROSIDL_PROTO_EXPORT(pj_module_free) void pj_module_free(uint64_t address, uint64_t) {
  std::free(writable_at(address));
}

}  // namespace rosidl_proto::plugin
