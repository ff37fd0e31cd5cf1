// Texts that recordings have of their types become the plans that Python makes of them.
#include "checks.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto::test {
namespace {

const std::string kRule(80, '=');

// What is wrong with a text, or that nothing is.
std::string wrong(const std::string& text, const std::string& type = "a/B") {
  Bytes packed;
  const char* found = read_ros2msg(text, type, &packed);
  return found == nullptr ? "nothing" : found;
}

TEST(the_plan_of_an_imu_has_the_bytes_of_python) {
  Bytes packed;
  CHECK(read_ros2msg(golden_file("imu_text"), "sensor_msgs/msg/Imu", &packed) == nullptr);
  CHECK(packed == golden("imu").bytes);
}

TEST(texts_that_are_not_of_messages_are_refused) {
  CHECK_EQUAL(wrong("int8 a\n"), "nothing");
  CHECK_EQUAL(wrong("int8 a\n" + kRule + "\nIDL: a/C\n"),
              "the text has definitions in IDL, of which only those in .msg are read");
}

}  // namespace
}  // namespace rosidl_proto::test
