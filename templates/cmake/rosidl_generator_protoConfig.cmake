# Found by rosidl_core_generators through the ament index: registers the generator of protobuf types and adapters.
#
# Variables that a project or the command line may set:
#   ROSIDL_PROTO_SKIP      generate nothing
#   ROSIDL_PROTO_PYTHON    the Python that has rosidl_adapter_proto (default: that of the other generators)
#   ROSIDL_PROTO_<OPTION>  an option of `rosidl-proto generate`; rosidl_generator_proto_arguments.cmake has which

find_package(ament_cmake_core QUIET REQUIRED)
# Generators run in the order of their registration. This one comes after that of Python, whose folder it installs to.
find_package(rosidl_generator_py QUIET)

# `rosidl-proto hook install` writes this file, with the Python that it runs in.
include("${CMAKE_CURRENT_LIST_DIR}/rosidl_generator_proto_python.cmake" OPTIONAL)

include("${CMAKE_CURRENT_LIST_DIR}/rosidl_generator_proto_arguments.cmake")

# Runs a command of the hook now, with the arguments in _proto_arguments, and stops if it fails.
macro(_rosidl_generator_proto_run command)
  # One argument a line; the file is only written anew if it changes.
  set(_proto_arguments_file "${_proto_output}/${command}_arguments")
  list(JOIN _proto_arguments "\n" _proto_text)
  file(WRITE "${_proto_arguments_file}.new" "${_proto_text}\n")
  configure_file("${_proto_arguments_file}.new" "${_proto_arguments_file}" COPYONLY)
  execute_process(COMMAND ${_proto_command} ${command} "@${_proto_arguments_file}" RESULT_VARIABLE _proto_result)
  if(NOT _proto_result MATCHES "^[0-9]+$")
    message(FATAL_ERROR
      "rosidl_generator_proto: ${_proto_python} cannot be run (${_proto_result}); set ROSIDL_PROTO_PYTHON to a Python "
      "that has rosidl_adapter_proto, or ROSIDL_PROTO_SKIP to build without protobuf types.")
  elseif(NOT _proto_result EQUAL 0)
    message(FATAL_ERROR
      "rosidl_generator_proto: no protobuf types can be made of ${PROJECT_NAME}; the reason is printed above. "
      "To build without them, set ROSIDL_PROTO_SKIP; to use another Python than ${_proto_python}, "
      "set ROSIDL_PROTO_PYTHON.")
  endif()
endmacro()

# The errors of rosidl_adapter name no file and no line, and it runs before all generators. What it gets is known when
# rosidl_generate_interfaces() sets this variable: there, definitions are parsed for the sake of our errors.
function(_rosidl_generator_proto_parse variable access)
  if(access STREQUAL "MODIFIED_ACCESS" AND NOT ROSIDL_PROTO_SKIP)
    _rosidl_generator_proto_arguments("${CMAKE_CURRENT_BINARY_DIR}/rosidl_generator_proto")
    _rosidl_generator_proto_run(parse)
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
