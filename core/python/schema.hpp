// What the Python module has of schemas that the core reads.
#pragma once

#include <nanobind/nanobind.h>

namespace rosidl_proto {

void define_schema(nanobind::module_& module);

}  // namespace rosidl_proto
