// The forms that elements of fields have in CDR and in protobuf, with every fact about each of them in one
// place.
//
// A new form is one line in the list and one specialization of `Form`; everything else is made from these.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <type_traits>

namespace rosidl_proto {

// What runs once for each field is put together from small pieces, which have to stay in registers.
#if defined(_MSC_VER)
#define ROSIDL_PROTO_INLINE __forceinline
#define ROSIDL_PROTO_INLINE_LAMBDA
#define ROSIDL_PROTO_NO_INLINE __declspec(noinline)
#else
#define ROSIDL_PROTO_INLINE __attribute__((always_inline)) inline
#define ROSIDL_PROTO_INLINE_LAMBDA __attribute__((always_inline))
#define ROSIDL_PROTO_NO_INLINE __attribute__((noinline))
#endif

// How one element lies in CDR, and what its values are: the names and numbers of `CdrForm` in
// rosidl_adapter_proto/interfaces/scalars.py. Those behind `Message` are of protobuf messages that do not
// come from ROS: in CDR they are what another form is, and in protobuf they are not.
#define ROSIDL_PROTO_CDR_FORMS(X) \
  X(Boolean, 1)                   \
  X(Uint8, 2)                     \
  X(Int8, 3)                      \
  X(Char, 4)                      \
  X(Uint16, 5)                    \
  X(Int16, 6)                     \
  X(Wchar, 7)                     \
  X(Uint32, 8)                    \
  X(Int32, 9)                     \
  X(Float, 10)                    \
  X(Uint64, 11)                   \
  X(Int64, 12)                    \
  X(Double, 13)                   \
  X(String, 14)                   \
  X(Wstring, 15)                  \
  X(Message, 16)                  \
  X(Varint32, 17)                 \
  X(Varuint32, 18)                \
  X(Varint64, 19)                 \
  X(Varuint64, 20)                \
  X(Zigzag32, 21)                 \
  X(Zigzag64, 22)                 \
  X(Bytes, 23)

enum class CdrForm : uint8_t {
#define ROSIDL_PROTO_FORM(name, number) name = number,
  ROSIDL_PROTO_CDR_FORMS(ROSIDL_PROTO_FORM)
#undef ROSIDL_PROTO_FORM
};

// The type of a protobuf field: the numbers of google.protobuf.FieldDescriptorProto.Type.
enum class ProtobufForm : uint8_t {
  None = 0,  // not in protobuf: skipped when CDR is read, zeros when it is written
  Double = 1,
  Float = 2,
  Int64 = 3,
  Uint64 = 4,
  Int32 = 5,
  Fixed64 = 6,
  Fixed32 = 7,
  Bool = 8,
  String = 9,
  Message = 11,
  Bytes = 12,
  Uint32 = 13,
  Sfixed32 = 15,
  Sfixed64 = 16,
  Sint32 = 17,
  Sint64 = 18,
};

// https://protobuf.dev/programming-guides/encoding/#structure
enum class WireType : uint8_t {
  Varint = 0,
  Fixed64 = 1,
  Delimited = 2,
  GroupStart = 3,
  GroupEnd = 4,
  Fixed32 = 5
};

constexpr WireType wire_type_of(ProtobufForm form) {
  switch (form) {
    case ProtobufForm::Bool:
    case ProtobufForm::Int32:
    case ProtobufForm::Int64:
    case ProtobufForm::Uint32:
    case ProtobufForm::Uint64:
    case ProtobufForm::Sint32:
    case ProtobufForm::Sint64:
      return WireType::Varint;
    case ProtobufForm::Fixed32:
    case ProtobufForm::Sfixed32:
    case ProtobufForm::Float:
      return WireType::Fixed32;
    case ProtobufForm::Fixed64:
    case ProtobufForm::Sfixed64:
    case ProtobufForm::Double:
      return WireType::Fixed64;
    case ProtobufForm::None:
    case ProtobufForm::String:
    case ProtobufForm::Bytes:
    case ProtobufForm::Message:
      return WireType::Delimited;
  }
  return WireType::Delimited;
}

// What all forms of numbers have. `Raw` are the bits in CDR, whose size is also their alignment (CORBA 3.3
// part 2, section 9.3.1). `single` and `many` are the protobuf types of one element and of an array or
// sequence.
template <class RawBits, ProtobufForm single, ProtobufForm many>
struct NumberForm {
  using Raw = RawBits;
  static constexpr bool kIsNumber = true, kIsString = false;
  static constexpr ProtobufForm kSingle = single, kMany = many;
  static constexpr uint64_t kSize = sizeof(Raw), kMinimumSize = sizeof(Raw);  // in CDR
  static constexpr WireType kWireType = wire_type_of(single);
  // Whether an array is one protobuf value, and whether that is text.
  static constexpr bool kIsText = many == ProtobufForm::String;
  static constexpr bool kIsOneValue = kIsText || many == ProtobufForm::Bytes;

  // What forms may have otherwise: the largest character, whether the bytes of an array are the same on the
  // other side, whether all bits are a value in CDR, and the text of the error if they are not.
  static constexpr uint64_t kLargestCharacter = 0;
  static constexpr bool kCopiesToProtobuf = false, kCopiesToCdr = false;
  static constexpr bool kTakesAll = true;
  static constexpr bool is_value(Raw) { return true; }
  static constexpr const char* kValues = "";  // before " and this one is {number}"
};

// A form whose `from_wire` takes every value in protobuf returns the bits in CDR: `Raw from_wire(uint64_t)`.
// One that refuses some returns whether it took the value, `bool from_wire(uint64_t, Raw*)`, and has what the
// error says: `number(uint64_t)`, an `int64_t` or a `double`, and `kRange`, after "{number} does not fit ".
template <class F, class = void>
constexpr bool kRefuses = false;
template <class F>
constexpr bool
    kRefuses<F, std::void_t<decltype(F::from_wire(uint64_t{}, static_cast<typename F::Raw*>(nullptr)))>> =
        true;

// Makes the bits in CDR of a value in protobuf; false if they cannot hold it.
template <class F>
ROSIDL_PROTO_INLINE constexpr bool from_wire(uint64_t value, typename F::Raw* raw) {
  if constexpr (kRefuses<F>) {
    static_assert(F::kRange[0] != '\0', "a form that refuses values says in kRange which ones it takes");
    return F::from_wire(value, raw);
  } else {
    *raw = F::from_wire(value);
    return true;
  }
}

// A number whose bits are the same in CDR and in protobuf.
template <class Raw, ProtobufForm form>
struct FixedForm : NumberForm<Raw, form, form> {
  static constexpr bool kCopiesToProtobuf = true, kCopiesToCdr = true;
  static constexpr uint64_t to_wire(Raw raw) { return raw; }
  static constexpr Raw from_wire(uint64_t value) { return static_cast<Raw>(value); }
};

// A number of 8 or 16 bits, which protobuf has as a varint: sign-extended to 64 bits, so that negative ones
// take 10 bytes (https://protobuf.dev/programming-guides/encoding/#signed-ints), and cut to 32 bits when it
// is read.
template <class T, ProtobufForm many_forms>
struct SmallForm
    : NumberForm<std::make_unsigned_t<T>,
                 std::is_signed<T>::value ? ProtobufForm::Int32 : ProtobufForm::Uint32, many_forms> {
  using Raw = std::make_unsigned_t<T>;
  static constexpr bool kCopiesToProtobuf = sizeof(T) == 1, kCopiesToCdr = sizeof(T) == 1;
  static constexpr uint64_t to_wire(Raw raw) {
    return static_cast<uint64_t>(static_cast<int64_t>(static_cast<T>(raw)));
  }
  static constexpr int64_t number(uint64_t value) {
    const auto cut = static_cast<uint32_t>(value);
    return std::is_signed<T>::value ? int64_t{static_cast<int32_t>(cut)} : int64_t{cut};
  }
  static constexpr bool from_wire(uint64_t value, Raw* raw) {
    const int64_t found = number(value);
    *raw = static_cast<Raw>(found);
    return found >= std::numeric_limits<T>::min() && found <= std::numeric_limits<T>::max();
  }
};

// A number of 32 or 64 bits, which protobuf has as a varint: negative ones sign-extended to 64 bits, and cut
// when it is read.
template <class T, ProtobufForm form>
struct VarintForm : NumberForm<std::make_unsigned_t<T>, form, form> {
  using Raw = std::make_unsigned_t<T>;
  static constexpr uint64_t to_wire(Raw raw) {
    return static_cast<uint64_t>(static_cast<int64_t>(static_cast<T>(raw)));
  }
  static constexpr Raw from_wire(uint64_t value) { return static_cast<Raw>(value); }
};

// The same with its sign in the lowest bit, so that small negative numbers are short.
template <class Raw, ProtobufForm form>
struct ZigzagForm : NumberForm<Raw, form, form> {
  static constexpr uint64_t to_wire(Raw raw) { return raw << 1 ^ (0 - (raw >> (8 * sizeof(Raw) - 1))); }
  static constexpr Raw from_wire(uint64_t value) {
    const auto cut = static_cast<Raw>(value);
    return cut >> 1 ^ (0 - (cut & 1));
  }
};

// A count of 4 bytes and so many units, of which `terminator` stand in every string.
template <ProtobufForm form, uint64_t unit_size, uint64_t terminator>
struct StringForm {
  static constexpr bool kIsNumber = false, kIsString = true;
  static constexpr bool kIsBytes = false;  // any bytes, and no text
  static constexpr ProtobufForm kSingle = form, kMany = form;
  static constexpr uint64_t kSize = 0, kMinimumSize = 4;  // in CDR
  static constexpr uint64_t kUnitSize = unit_size, kTerminator = terminator;
  static constexpr uint64_t kLargestCharacter = 0;
  static constexpr const char* kValues = "";
};

template <CdrForm form>
struct Form;

// In CDR | in protobuf

// 1 byte, 0 or 1 | bool
template <>
struct Form<CdrForm::Boolean> : NumberForm<uint8_t, ProtobufForm::Bool, ProtobufForm::Bool> {
  static constexpr bool kCopiesToProtobuf = true;
  static constexpr bool kTakesAll = false;
  static constexpr bool is_value(uint8_t raw) { return raw <= 1; }
  static constexpr const char* kValues = "a boolean is 0 or 1";
  static constexpr uint64_t to_wire(uint8_t raw) { return raw; }
  static constexpr uint8_t from_wire(uint64_t value) { return value != 0; }
};

// 1 byte | uint32, arrays: bytes
template <>
struct Form<CdrForm::Uint8> : SmallForm<uint8_t, ProtobufForm::Bytes> {
  static constexpr const char* kRange = "uint8; give a number from 0 to 255";
};

// 1 byte | int32, arrays: bytes
template <>
struct Form<CdrForm::Int8> : SmallForm<int8_t, ProtobufForm::Bytes> {
  static constexpr const char* kRange = "int8; give a number from -128 to 127";
};

// 1 byte, an ASCII character | uint32, arrays: string
template <>
struct Form<CdrForm::Char> : SmallForm<uint8_t, ProtobufForm::String> {
  static constexpr uint64_t kLargestCharacter = 0x7f;  // interfaces/scalars.py says why
  static constexpr bool kTakesAll = false;
  static constexpr bool is_value(uint8_t raw) { return raw <= kLargestCharacter; }
  static constexpr const char* kValues = "a char goes from 0 to 127 (ASCII)";
  static constexpr const char* kRange = "char; give a number from 0 to 127 (ASCII)";
  static constexpr bool from_wire(uint64_t value, uint8_t* raw) {
    return SmallForm::from_wire(value, raw) && is_value(*raw);
  }
};

// 2 bytes | uint32
template <>
struct Form<CdrForm::Uint16> : SmallForm<uint16_t, ProtobufForm::Uint32> {
  static constexpr const char* kRange = "uint16; give a number from 0 to 65535";
};

// 2 bytes | int32
template <>
struct Form<CdrForm::Int16> : SmallForm<int16_t, ProtobufForm::Int32> {
  static constexpr const char* kRange = "int16; give a number from -32768 to 32767";
};

// 2 bytes, a UTF-16 code unit (Fast CDR 2) | uint32, arrays: string
template <>
struct Form<CdrForm::Wchar> : SmallForm<uint16_t, ProtobufForm::String> {
  static constexpr uint64_t kLargestCharacter = 0xffff;
  static constexpr const char* kRange = Form<CdrForm::Uint16>::kRange;
};

// 4 bytes | fixed32, sfixed32, float
template <>
struct Form<CdrForm::Uint32> : FixedForm<uint32_t, ProtobufForm::Fixed32> {};
template <>
struct Form<CdrForm::Int32> : FixedForm<uint32_t, ProtobufForm::Sfixed32> {};
template <>
struct Form<CdrForm::Float> : FixedForm<uint32_t, ProtobufForm::Float> {};

// 8 bytes | fixed64, sfixed64, double
template <>
struct Form<CdrForm::Uint64> : FixedForm<uint64_t, ProtobufForm::Fixed64> {};
template <>
struct Form<CdrForm::Int64> : FixedForm<uint64_t, ProtobufForm::Sfixed64> {};
template <>
struct Form<CdrForm::Double> : FixedForm<uint64_t, ProtobufForm::Double> {};

// bytes with NUL at the end | string
template <>
struct Form<CdrForm::String> : StringForm<ProtobufForm::String, 1, 1> {};

// 4 bytes for each UTF-16 code unit | bytes: UTF-16LE
template <>
struct Form<CdrForm::Wstring> : StringForm<ProtobufForm::Bytes, 4, 0> {};

// its fields | submessage
template <>
struct Form<CdrForm::Message> {
  static constexpr bool kIsNumber = false, kIsString = false;
  static constexpr ProtobufForm kSingle = ProtobufForm::Message, kMany = ProtobufForm::Message;
  static constexpr uint64_t kLargestCharacter = 0;
  static constexpr const char* kValues = "";
};

// As Int32, Uint32, Int64 and Uint64 | int32, uint32, int64, uint64, sint32, sint64
template <>
struct Form<CdrForm::Varint32> : VarintForm<int32_t, ProtobufForm::Int32> {};
template <>
struct Form<CdrForm::Varuint32> : VarintForm<uint32_t, ProtobufForm::Uint32> {};
template <>
struct Form<CdrForm::Varint64> : VarintForm<int64_t, ProtobufForm::Int64> {};
template <>
struct Form<CdrForm::Varuint64> : VarintForm<uint64_t, ProtobufForm::Uint64> {};
template <>
struct Form<CdrForm::Zigzag32> : ZigzagForm<uint32_t, ProtobufForm::Sint32> {};
template <>
struct Form<CdrForm::Zigzag64> : ZigzagForm<uint64_t, ProtobufForm::Sint64> {};

// As a sequence of Uint8, whose elements may be repeated here | bytes
template <>
struct Form<CdrForm::Bytes> : StringForm<ProtobufForm::Bytes, 1, 0> {
  static constexpr bool kIsBytes = true;
};

// Calls `visitor` with the `Form` of a form. A form that has no `Form` does not compile.
template <class Visitor>
ROSIDL_PROTO_INLINE constexpr auto visit(CdrForm form, Visitor visitor) {
  switch (form) {
#define ROSIDL_PROTO_FORM(name, number) \
  case CdrForm::name:                   \
    return visitor(Form<CdrForm::name>{});
    ROSIDL_PROTO_CDR_FORMS(ROSIDL_PROTO_FORM)
#undef ROSIDL_PROTO_FORM
  }
  std::abort();  // loading a plan lets no other number in
}

}  // namespace rosidl_proto
