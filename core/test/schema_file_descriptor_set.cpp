// Serialized FileDescriptorSets become the plans that Python makes of the same messages.
#include "checks.hpp"
#include "rosidl_adapter_proto/schema.hpp"

namespace rosidl_proto::test {
namespace {

TEST(the_plan_of_a_general_message_has_the_bytes_of_python) {
  const Bytes set = golden("general_set").bytes;
  Bytes packed;
  FlatNotes notes;
  CHECK(read_file_descriptor_set(set.data(), set.size(), "test.General", &packed, &notes) == nullptr);
  CHECK(packed == golden("general").bytes);
  std::string text;
  for (const FlatNote& note : notes) {
    for (const FlatNote::EnumValue& each : note.enum_values)
      text += std::to_string(each.number) + " " + each.name + " ";
    text += note.map ? "map " : note.single ? "single " : "";
  }
  CHECK_EQUAL(text, "-3 DARK 0 BLACK 7 RED -3 DARK 0 BLACK 7 RED map map single single single ");
}

TEST(a_set_that_is_cut_off_is_an_error) {
  const Bytes set = golden("general_set").bytes;
  for (size_t size = 0; size < set.size(); ++size) {
    const Bytes part(set.begin(), set.begin() + static_cast<std::ptrdiff_t>(size));
    Bytes packed;
    FlatNotes notes;
    CHECK(read_file_descriptor_set(part.data(), part.size(), "test.General", &packed, &notes) != nullptr);
  }
}

TEST(a_set_ends_with_the_nul_behind_it) {
  Bytes set = golden("general_set").bytes;
  const size_t size = set.size();
  CHECK_EQUAL(file_descriptor_set_size(set.data(), size), size);
  set.push_back(0);
  set.push_back(0x0a);
  CHECK_EQUAL(file_descriptor_set_size(set.data(), set.size()), size);
  // Without a NUL, and with a file that has no end, all of it counts.
  CHECK_EQUAL(file_descriptor_set_size(set.data(), size - 1), size - 1);
  const Bytes nothing = {0};
  CHECK_EQUAL(file_descriptor_set_size(nothing.data(), 1), 0u);
}

}  // namespace
}  // namespace rosidl_proto::test
