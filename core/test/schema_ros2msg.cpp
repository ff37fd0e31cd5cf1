// Texts that recordings have of their types become the plans that Python makes of them.
#include "checks.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto::test {
namespace {

const std::string kRule(80, '=');

struct Case {
  std::string text, wrong;
};

std::string section(const std::string& name, const std::string& text) {
  return kRule + "\nMSG: " + name + "\n" + text;
}

// What is wrong with a text; empty if nothing is.
std::string wrong(const std::string& text, const std::string& type) {
  Bytes packed;
  const char* found = read_ros2msg(text, type, &packed);
  CHECK_EQUAL(packed.empty(), found != nullptr);
  return found == nullptr ? "" : found;
}

TEST(the_plan_of_an_imu_has_the_bytes_of_python) {
  Bytes packed;
  CHECK(read_ros2msg(golden_file("imu_text"), "sensor_msgs/msg/Imu", &packed) == nullptr);
  CHECK(packed == golden("imu").bytes);
}

TEST(ways_to_write_the_same_type) {
  const auto plan = [](const std::string& text) {
    Bytes packed;
    CHECK(read_ros2msg(text, "a/B", &packed) == nullptr);
    return packed;
  };
  const std::string c = "int8 x\n", text = "C[2] c\nbuiltin_interfaces/Time t\n";
  const Bytes expected = plan(text + section("a/C", c));
  for (const std::string& each : {
           text + section("C", c),
           text + "\n" + section("a/msg/C  ", c) + "\n\n",
           section("a/C", c) + section("a/B", text),
           text + section("a/C", "") + section("a/C", c) + section("a/C", "  int8\tx\r\n"),
           "\xef\xbb\xbf# comment\r\n a/msg/C[2]\t c # K\xf6ln\r\n int8 A = 5\r\ntime t" + std::string("\n") +
               section("a/C", "int8 x 7\n"),
           text + section("a/C", c) + section("builtin_interfaces/Time", "int32 sec\nuint32 nanosec\n"),
       }) {
    CHECK(plan(each) == expected);
  }
}

TEST(texts_that_are_not_valid_say_why) {
  const char* const kType = "a field or constant does not have a type of .msg";
  const char* const kCount = "the length of an array or a bound is not a whole number from 1 to 4294967295";
  const char* const kField = "a field does not have a name of letters, digits and underscores";
  const char* const kTwice = "a definition has two fields or two constants with the same name";
  const Case cases[] = {
      {"int8", "a line does not have both a type and a name"},
      {"int8 a-b", kField},
      {"int8 1a", kField},
      {"int8 _a", kField},
      {"int a", kType},
      {"string<5 a", kType},
      {"int8<=5 a", kType},
      {"int8[ a", kType},
      {"int8]2[ a", kType},
      {"b/c/D a", kType},
      {"b/msg/msg/D a", kType},
      {"Sample_ a", kType},
      {"int8[0] a", kCount},
      {"int8[-1] a", kCount},
      {"int8[+1] a", kCount},
      {"int8[4294967296] a", kCount},
      {"int8[00000000001] a", kCount},
      {"int8[<=] a", kCount},
      {"int8[2][2] a", kCount},
      {"string<= a", kCount},
      {"int8 a\nbool a", kTwice},
      {"int8 A=1\nint8 A=2", kTwice},
      {"int8 =1", "a constant does not have a name of letters, digits and underscores"},
      {"int8 a 5=1", "a constant does not have a name of letters, digits and underscores"},
      {"C X=1", "a constant is neither a number nor a bool, string or wstring"},
      {"int8[2] X=1", "a constant is neither a number nor a bool, string or wstring"},
      {"string<=5 X=1", "a constant is neither a number nor a bool, string or wstring"},
      {"time t 5", "a field that is a message has a default value"},
      {"C c", "the text refers to a type and does not define it"},
      {"B b", "messages contain each other"},
      {"C c\n" + section("a/C", "B b"), "messages contain each other"},
      {"int8 a\n---\nint8 b\n",
       "the text is that of a service or an action, of which only those of messages are read"},
      {"int8 a\n" + kRule + "\nIDL: a/C\n",
       "the text has definitions in IDL, of which only those in .msg are read"},
      {"int8 a\n" + kRule + "\nSRV: a/C\n",
       "the text has definitions of services or actions, of which only those of messages are read"},
      {"int8 a\n" + section("a C", ""),
       "a line `MSG: ` of the text does not have the name of a message behind it"},
      {"int8 a\n" + section("", ""),
       "a line `MSG: ` of the text does not have the name of a message behind it"},
      {"C c\n" + section("C", "int8 a") + "\n" + section("C", "int8 b"),
       "the text defines a type twice, not in the same way"},
      {std::string(kMaximumSchemaSize + 1, ' '), "the text has more than 4194304 bytes"},
  };
  for (const Case& each : cases) CHECK_EQUAL(wrong(each.text, "a/B"), each.wrong);
}

TEST(types_that_no_text_can_have) {
  const char* const kName = "the type does not have a name such as sensor_msgs/msg/Imu";
  for (const char* type : {"", "B", "a/", "/B", "a/b/C", "a/msg/b/C", "a/msg/B ", "1/B", "a.msg.B"}) {
    CHECK_EQUAL(wrong("int8 a", type), kName);
  }
  CHECK_EQUAL(wrong("", "a/srv/B_Request"), "the text does not define the type");
  CHECK_EQUAL(wrong("int8 a", "a/Sample_"), "a definition does not have the name of a message");
}

// Types T0 to T<count>, each in the one before.
std::string nested(int count) {
  std::string text = "T1 a\n";
  for (int i = 1; i < count; ++i) {
    const std::string next = std::to_string(i + 1);
    text += section("T" + std::to_string(i), i + 1 < count ? "T" + next + " a\n" : "int8 a\n");
  }
  return text;
}

TEST(what_has_no_end_is_refused) {
  CHECK_EQUAL(wrong(nested(100), "a/T0"), "");
  CHECK_EQUAL(wrong(nested(101), "a/T0"), "messages are nested more than 100 deep");
  // The other way to T50 is short, and has been taken before.
  CHECK_EQUAL(wrong("T50 z\n" + nested(101), "a/T0"), "messages are nested more than 100 deep");

  std::string fields;
  for (int i = 0; i < 20'000; ++i) fields += "int8 a" + std::to_string(i) + "\n";
  CHECK_EQUAL(wrong(fields, "a/B"), "");
  CHECK_EQUAL(wrong(fields + "int8 b\n", "a/B"),
              "the type has more than 20000 fields, those of the types in it included");

  std::string definitions;
  for (int i = 0; i < 10'000; ++i) definitions += section("T" + std::to_string(i), "");
  CHECK_EQUAL(wrong(definitions, "a/T0"), "");
  CHECK_EQUAL(wrong(definitions + section("U", ""), "a/T0"), "the text has more than 10000 definitions");
}

// CRC-32 is linear: any of two pieces with the same hash can stand in the place of the other.
TEST(names_that_are_made_to_collide_are_refused) {
  const char* const pieces[] = {"plumless", "buckeroo"};
  std::string fields;
  for (int i = 0; i < 128; ++i) {
    fields += "int8 ";
    for (int bit = 0; bit < 7; ++bit) fields += pieces[i >> bit & 1];
    fields += "\n";
  }
  CHECK_EQUAL(wrong(fields, "a/B"), "too many fields of a message have names with the same hash");
  CHECK_EQUAL(wrong(fields.substr(0, 64 * 62), "a/B"), "");
}

}  // namespace
}  // namespace rosidl_proto::test
