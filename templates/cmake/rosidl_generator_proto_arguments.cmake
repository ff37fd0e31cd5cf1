# What the part of the hook that is in Python is called with.

# Sets _proto_package, _proto_strict, _proto_output, _proto_command, _proto_definitions and _proto_arguments, for what
# rosidl_generate_interfaces() got.
macro(_rosidl_generator_proto_arguments output)
  set(_proto_python "${ROSIDL_PROTO_PYTHON}")
  if(NOT _proto_python)
    set(_proto_python "${_rosidl_generator_proto_python}")
  endif()
  if(NOT _proto_python)
    find_package(Python3 REQUIRED COMPONENTS Interpreter)
    set(_proto_python "${Python3_EXECUTABLE}")
  endif()
  set(_proto_package "${PROJECT_NAME}")
  set(_proto_strict "${ROSIDL_PROTO_STRICT}")
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

  # Options have the names of generate/settings.py: ROSIDL_PROTO_LOCK_FILE is --lock-file. Paths are relative to the package.
  list(APPEND _proto_arguments --folder "${CMAKE_CURRENT_SOURCE_DIR}")
  foreach(_option numbering lock-file events python-root)
    string(TOUPPER "ROSIDL_PROTO_${_option}" _variable)
    string(REPLACE "-" "_" _variable "${_variable}")
    if(NOT "${${_variable}}" STREQUAL "")
      list(APPEND _proto_arguments "--${_option}" "${${_variable}}")
    endif()
  endforeach()
endmacro()

# Writes the arguments to a file, one a line, which is only written anew if it changes.
macro(_rosidl_generator_proto_write_arguments)
  list(JOIN _proto_arguments "\n" _proto_text)
  file(WRITE "${_proto_output}/arguments.new" "${_proto_text}\n")
  configure_file("${_proto_output}/arguments.new" "${_proto_output}/arguments" COPYONLY)
endmacro()
