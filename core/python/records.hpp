// What the Python module has for the records of recordings.
#pragma once

#include <nanobind/nanobind.h>

namespace rosidl_proto {

void define_records(nanobind::module_& module);

}  // namespace rosidl_proto
