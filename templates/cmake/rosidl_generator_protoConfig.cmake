# Found by rosidl_core_generators through the ament index: registers the generator of protobuf types and adapters.
#
# Variables that a project or the command line may set:
#   ROSIDL_PROTO_SKIP      generate nothing
#   ROSIDL_PROTO_STRICT    stop where nothing can be generated, instead of building on without protobuf types
#   ROSIDL_PROTO_PYTHON    the Python that has rosidl_adapter_proto (default: that of the other generators)
#   ROSIDL_PROTO_<OPTION>  an option of `rosidl-proto generate`; rosidl_generator_proto_arguments.cmake has which

find_package(ament_cmake_core QUIET REQUIRED)
# Generators run in the order of their registration. This one comes after that of Python, whose folder it installs to.
find_package(rosidl_generator_py QUIET)
find_package(ament_cmake_python QUIET)

# `rosidl-proto hook install` writes this file, with the Python that it runs in.
include("${CMAKE_CURRENT_LIST_DIR}/rosidl_generator_proto_python.cmake" OPTIONAL)

include("${CMAKE_CURRENT_LIST_DIR}/rosidl_generator_proto_arguments.cmake")
include("${CMAKE_CURRENT_LIST_DIR}/rosidl_generator_proto_run.cmake")

# The errors of rosidl_adapter name no file and no line, and it runs before all generators. What it gets is known when
# rosidl_generate_interfaces() sets this variable: there, definitions are parsed for the sake of our errors.
function(_rosidl_generator_proto_parse variable access)
  if(access STREQUAL "MODIFIED_ACCESS" AND NOT ROSIDL_PROTO_SKIP)
    _rosidl_generator_proto_arguments("${CMAKE_CURRENT_BINARY_DIR}/rosidl_generator_proto")
    _rosidl_generator_proto_write_arguments()
    _rosidl_generator_proto_run(_succeeded parse)
    if(NOT _succeeded)
      set_property(GLOBAL PROPERTY _rosidl_generator_proto_refused "${_interface_tuples}")
    endif()
  endif()
endfunction()

if(NOT _rosidl_generator_proto_registered)
  set(_rosidl_generator_proto_registered TRUE)
  variable_watch(_adapter_arguments_file _rosidl_generator_proto_parse)
  ament_register_extension(
    "rosidl_generate_idl_interfaces"
    "rosidl_generator_proto"
    "rosidl_generator_proto_generate_interfaces.cmake")
endif()
