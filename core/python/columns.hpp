// What the Python module has for columns.
#pragma once

#include <nanobind/nanobind.h>

namespace rosidl_proto {

void define_columns(nanobind::module_& module);

}  // namespace rosidl_proto
