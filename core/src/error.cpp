#include "rosidl_adapter_proto/error.hpp"

#include <cstdlib>

#include "text.hpp"

namespace rosidl_proto {
namespace {

// {a} and {b} are numbers of the error, {e} is `a` as the name of an encapsulation, {n} is the number that
// `a` is on the wire for the form `b`, {r} is the range of that form and {v} are its values in CDR.
const char* text_of(Reason reason) {
  switch (reason) {
    case Reason::None:
      return "nothing is wrong";
    case Reason::Truncated:
      return "{a} bytes are needed and {b} are left; the data is cut off or of another type";
    case Reason::Header:
      return "a CDR message begins with a header of 4 bytes and this one has {a}; give the whole serialized "
             "message";
    case Reason::Encapsulation:
      return "the encapsulation is {e}, and only plain CDR (CDR_BE, CDR_LE) is read; serialize the message "
             "as plain "
             "CDR";
    case Reason::CdrValue:
      return "{v} and this one is {a}; the data is damaged or of another type";
    case Reason::NoTerminator:
      return "the string does not end with NUL; the data is damaged or of another type";
    case Reason::WstringUnit:
      return "a UTF-16 code unit goes up to 65535 and this one is {a}; the data is damaged or of another "
             "type";
    case Reason::Trailing:
      return "{a} bytes follow the last field; the data is of another type";
    case Reason::WithoutBytes:
      return "{a} elements that take no bytes are announced, and a message may have {b}; the data is damaged "
             "or "
             "of another type";
    case Reason::Ros1Time:
      return "{a} seconds do not fit int32, which a time has in ROS 2; give a time before 2038";
    case Reason::Ros1Duration:
      return "-{a} nanoseconds do not fit uint32, which a duration has in ROS 2; give nanoseconds from 0 on";
    case Reason::WireTruncated:
      return "{a} bytes are needed and {b} are left; the data is cut off or no protobuf message";
    case Reason::WireVarint:
      return "a varint does not end; the data is cut off or no protobuf message";
    case Reason::WireTag:
      return "{a} is no field number; the data is damaged or no protobuf message";
    case Reason::WireType:
      return "field number {a} has wire type {b}, which protobuf does not have; the data is damaged or no "
             "protobuf "
             "message";
    case Reason::WireGroup:
      return "the group of field number {a} has no end, no beginning or too many groups inside; the data is "
             "damaged or no protobuf message";
    case Reason::WirePacked:
      return "a packed field of {a} bytes does not hold whole elements of {b} bytes; the data is damaged or "
             "of "
             "another type";
    case Reason::WireSize:
      return "{a} bytes are more than a protobuf message can have (2147483647); split the message";
    case Reason::ArrayLength:
      return "the array has {a} elements; give {b}, or none for zeros";
    case Reason::Range:
      return "{n} does not fit {r}";
    case Reason::NulInString:
      return "the string contains NUL, which ends a string in ROS; remove it";
    case Reason::OddWstring:
      return "{a} bytes are no UTF-16, which has 2 bytes for each code unit; encode the text as UTF-16LE";
    case Reason::Utf8:
      return "the text is not valid UTF-8; encode it as UTF-8, or use bytes for what is not text";
    case Reason::Utf16:
      return "half of a surrogate pair stands alone, which text cannot hold; send both halves";
    case Reason::StringBound:
      return "the string has {a} characters and its bound is {b}; shorten it";
    case Reason::SequenceBound:
      return "the sequence has {a} elements and its bound is {b}; remove the rest";
    case Reason::Count:
      return "{a} elements are announced, which {b} bytes cannot hold; the data is cut off or of another "
             "type";
    case Reason::TooLarge:
      return "the result would have more than {a} bytes; split the message or raise the size limit";
    case Reason::OutOfMemory:
      return "there is not enough memory for the result; split the message";
    case Reason::Partial:
      return "only chosen fields are transcoded, and a ROS message needs all of them; use a transcoder "
             "without fields";
    case Reason::ColumnsFull:
      return "a column would have more than {a} bytes, or all of them more than twice that; choose fewer "
             "fields";
    case Reason::NoRoom:
      return "there is no room for the result";
    case Reason::Changed:
      return "the data changed while it was read; give a copy that nobody writes to";
  }
  return "";
}

// DDS-XTypes 1.3: section 7.6.2.1.2 for RTPS (up to 0x000b), section 7.4.3.4 for other uses (from 0x0010 on).
struct Encapsulation {
  uint16_t id;
  const char* name;
};
constexpr Encapsulation kEncapsulations[] = {
    {0x0002, "PL_CDR_BE"},  {0x0003, "PL_CDR_LE"}, {0x0004, "XML"},       {0x0006, "CDR2_BE"},
    {0x0007, "CDR2_LE"},    {0x0008, "D_CDR2_BE"}, {0x0009, "D_CDR2_LE"}, {0x000a, "PL_CDR2_BE"},
    {0x000b, "PL_CDR2_LE"}, {0x0010, "CDR2_BE"},   {0x0011, "CDR2_LE"},   {0x0012, "PL_CDR2_BE"},
    {0x0013, "PL_CDR2_LE"}, {0x0014, "D_CDR2_BE"}, {0x0015, "D_CDR2_LE"},
};

std::string encapsulation(uint64_t id) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string number = "0x";
  for (int shift = 12; shift >= 0; shift -= 4) number += kDigits[id >> shift & 15];
  for (const Encapsulation& each : kEncapsulations) {
    if (each.id == id) return std::string(each.name) + " (" + number + ")";
  }
  return "unknown (" + number + ")";
}

std::string refused_number(CdrForm cdr, uint64_t value) {
  return visit(cdr, [value](auto form) -> std::string {
    using F = decltype(form);
    if constexpr (kRefuses<F>) {
      return number_text(F::number(value));
    } else {
      return "";
    }
  });
}

const char* range(CdrForm cdr) {
  return visit(cdr, [](auto form) {
    using F = decltype(form);
    if constexpr (kRefuses<F>) {
      return F::kRange;
    } else {
      return "";
    }
  });
}

}  // namespace

std::string field_path(const Error& error, const Plan& plan) {
  std::string path;
  for (uint32_t i = error.depth; i-- > 0;) {
    if (!path.empty()) path += '.';
    path += plan.text(plan.operation(error.path[i].operation).name);
    if (error.path[i].element != kNoElement) path += '[' + std::to_string(error.path[i].element) + ']';
  }
  return path;
}

std::string reason(const Error& error) {
  std::string text;
  for (const char* p = text_of(error.reason); *p != '\0'; ++p) {
    if (*p != '{') {
      text += *p;
      continue;
    }
    switch (p[1]) {
      case 'a':
        text += std::to_string(error.a);
        break;
      case 'b':
        text += std::to_string(error.b);
        break;
      case 'n':
        text += refused_number(static_cast<CdrForm>(error.b), error.a);
        break;
      case 'r':
        text += range(static_cast<CdrForm>(error.b));
        break;
      case 'v':
        text += visit(static_cast<CdrForm>(error.b), [](auto form) { return decltype(form)::kValues; });
        break;
      case 'e':
        text += encapsulation(error.a);
        break;
      default:
        std::abort();  // a text above has a letter that nobody knows
    }
    p += 2;
  }
  return text;
}

}  // namespace rosidl_proto
