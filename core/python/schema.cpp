#include "schema.hpp"

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

}  // namespace

void define_schema(nb::module_& module) {
  module.def("read_ros2msg", &plan_of_ros2msg, nb::arg("text"), nb::arg("type_name"));
}

}  // namespace rosidl_proto
