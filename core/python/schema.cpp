#include "schema.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <rosidl_adapter_proto/schema.hpp>

namespace rosidl_proto {
namespace {

namespace nb = nanobind;

nb::bytes plan_of_ros2msg(nb::bytes text, std::string_view type_name) {
  std::vector<uint8_t> plan;
  const char* wrong = read_ros2msg({text.c_str(), text.size()}, type_name, &plan);
  if (wrong != nullptr) throw nb::value_error(wrong);
  return nb::bytes(plan.data(), plan.size());
}

// Returns the plan and, of each note, the values of an enum, whether it is a map, and whether it is single.
nb::tuple plan_of_file_descriptor_set(nb::bytes data, std::string_view type_name) {
  std::vector<uint8_t> plan;
  FlatNotes notes;
  const char* wrong = read_file_descriptor_set(static_cast<const uint8_t*>(data.data()), data.size(),
                                               type_name, &plan, &notes);
  if (wrong != nullptr) throw nb::value_error(wrong);
  nb::list result;
  for (const FlatNote& note : notes) {
    nb::list values;
    for (const FlatNote::EnumValue& each : note.enum_values)
      values.append(nb::make_tuple(each.number, each.name));
    result.append(nb::make_tuple(nb::tuple(values), note.map, note.single));
  }
  return nb::make_tuple(nb::bytes(plan.data(), plan.size()), result);
}

}  // namespace

void define_schema(nb::module_& module) {
  module.def("read_ros2msg", &plan_of_ros2msg, nb::arg("text"), nb::arg("type_name"));
  module.def("read_file_descriptor_set", &plan_of_file_descriptor_set, nb::arg("data"), nb::arg("type_name"));
}

}  // namespace rosidl_proto
