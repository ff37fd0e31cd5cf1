# Found by rosidl_core_generators through the ament index: registers the generator of protobuf types and adapters.
#
# Variables that a project or the command line may set:
#   ROSIDL_PROTO_SKIP         generate nothing
#   ROSIDL_PROTO_NUMBERING    how fields are numbered: hash (default) or sequential
#   ROSIDL_PROTO_LOCK_FILE    where sequential numbers are kept (default: rosidl-proto.lock of the package)
#   ROSIDL_PROTO_EVENTS       include the _Event messages of service introspection
#   ROSIDL_PROTO_PYTHON_ROOT  the namespace package of the generated Python packages (default: rosidl_proto)
#   ROSIDL_PROTO_PYTHON       the Python that has rosidl_adapter_proto (default: that of the other generators)

find_package(ament_cmake_core QUIET REQUIRED)
# Generators run in the order of their registration. This one comes after that of Python, whose folder it installs to.
find_package(rosidl_generator_py QUIET)

# `rosidl-proto hook install` writes this file, with the Python that it runs in.
include("${CMAKE_CURRENT_LIST_DIR}/rosidl_generator_proto_python.cmake" OPTIONAL)

# Sets _proto_output, _proto_command, _proto_definitions and _proto_arguments, for what rosidl_generate_interfaces() got.
macro(_rosidl_generator_proto_arguments output)
  set(_proto_python "${ROSIDL_PROTO_PYTHON}")
  if(NOT _proto_python)
    set(_proto_python "${_rosidl_generator_proto_python}")
  endif()
  if(NOT _proto_python)
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
    set(_proto_python "${Python3_EXECUTABLE}")
  endif()
  set(_proto_command "${_proto_python}" -m rosidl_adapter_proto.hooks.ament)
  set(_proto_output "${output}")
  set(_proto_arguments --package "${PROJECT_NAME}" --output "${_proto_output}")

  # The definitions as they were written, and not the .idl files that ROS makes of them: errors name these.
  set(_proto_definitions "")
  foreach(_tuple ${_interface_tuples})
    list(APPEND _proto_arguments --interface "${_tuple}")
    string(REGEX REPLACE ":([^:]*)$" "/\\1" _definition "${_tuple}")
    list(APPEND _proto_definitions "${_definition}")
  endforeach()

  if(ROSIDL_PROTO_NUMBERING)
    list(APPEND _proto_arguments --numbering "${ROSIDL_PROTO_NUMBERING}")
  endif()
  set(_proto_lock_file "${ROSIDL_PROTO_LOCK_FILE}")
  if(NOT _proto_lock_file)
    set(_proto_lock_file "rosidl-proto.lock")
  endif()
  get_filename_component(_proto_lock_file "${_proto_lock_file}" ABSOLUTE BASE_DIR "${CMAKE_CURRENT_SOURCE_DIR}")
  list(APPEND _proto_arguments --lock-file "${_proto_lock_file}")
  if(ROSIDL_PROTO_EVENTS)
    list(APPEND _proto_arguments --events)
  endif()
  if(ROSIDL_PROTO_PYTHON_ROOT)
    list(APPEND _proto_arguments --python-root "${ROSIDL_PROTO_PYTHON_ROOT}")
  endif()
endmacro()

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
