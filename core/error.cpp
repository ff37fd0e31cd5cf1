#include "error.hpp"

namespace rosidl_proto {
namespace {

// {a} and {b} are numbers of the error, {s} is `a` as a signed number, {e} is `a` as the name of an
// encapsulation.
constexpr const char* kTexts[kReasons] = {
    "nothing is wrong",
    "{a} bytes are needed and {b} are left; the data is cut off or of another type",
    "a CDR message begins with a header of 4 bytes and this one has {a}; give the whole serialized message",
    "the encapsulation is {e}, and only plain CDR (CDR_BE, CDR_LE) is read; serialize the message as plain "
    "CDR",
    "a boolean is 0 or 1 in CDR and this one is {a}; the data is damaged or of another type",
    "the string does not end with NUL; the data is damaged or of another type",
    "a UTF-16 code unit goes up to 65535 and this one is {a}; the data is damaged or of another type",
    "{a} bytes follow the last field; the data is of another type",
    "{a} bytes are needed and {b} are left; the data is cut off or no protobuf message",
    "a varint does not end; the data is cut off or no protobuf message",
    "{a} is no field number; the data is damaged or no protobuf message",
    "field number {a} has wire type {b}, which protobuf does not have; the data is damaged or no protobuf "
    "message",
    "field number {a} is a group, which proto3 does not have; serialize the message with a proto3 schema",
    "a packed field of {a} bytes does not hold whole elements of {b} bytes; the data is damaged or of "
    "another type",
    "{a} bytes are more than a protobuf message can have (2147483647); split the message",
    "the array has {a} elements; give {b}, or none for zeros",
    "{s} does not fit uint8; give a number from 0 to 255",
    "{s} does not fit int8; give a number from -128 to 127",
    "{s} does not fit uint16; give a number from 0 to 65535",
    "{s} does not fit int16; give a number from -32768 to 32767",
    "the string contains NUL, which ends a string in ROS; remove it",
    "{a} bytes are no UTF-16, which has 2 bytes for each code unit; encode the text as UTF-16LE",
    "the text is not valid UTF-8; encode it as UTF-8, or use bytes for what is not text",
    "the text is not valid UTF-16: a surrogate stands alone; encode the text as UTF-16LE",
    "the string has {a} characters and its bound is {b}; shorten it",
    "the sequence has {a} elements and its bound is {b}; remove the rest",
    "{a} elements are announced, which {b} bytes cannot hold; the data is cut off or of another type",
    "the result would have more than {a} bytes; split the message or raise the size limit",
    "there is not enough memory for the result; split the message",
    "the data changed while it was read; give a copy that nobody writes to",
};

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

}  // namespace

std::string field_path(const Error& error, const Plan& plan) {
  std::string path;
  for (uint32_t i = error.depth; i-- > 0;) {
    if (!path.empty()) path += '.';
    path += plan.name(error.path[i].operation);
    if (error.path[i].element != kNoElement) path += '[' + std::to_string(error.path[i].element) + ']';
  }
  return path;
}

std::string reason(const Error& error) {
  std::string text;
  for (const char* p = kTexts[static_cast<unsigned>(error.reason)]; *p != '\0'; ++p) {
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
      case 's':
        text += std::to_string(static_cast<int64_t>(error.a));
        break;
      default:
        text += encapsulation(error.a);
    }
    p += 2;
  }
  return text;
}

}  // namespace rosidl_proto
