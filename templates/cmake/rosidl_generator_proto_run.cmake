# Runs the part of the hook that is in Python, while CMake configures, builds and installs.
#
# ROS builds a package without us, too. So what cannot be served is skipped with a warning; with ROSIDL_PROTO_STRICT it is
# an error. The variables that this reads are those of rosidl_generator_proto_arguments.cmake.

# Warns of why there are no protobuf types. A build has the same reason as configuring just before it: that is said once.
function(_rosidl_generator_proto_refuse reason)
  string(STRIP "${reason}" _text)
  string(REPLACE "\n" "\n    " _text "${_text}")
  string(CONCAT _text
    "rosidl_generator_proto: no protobuf types can be made of ${_proto_package}.\n"
    "    ${_text}\n")
  if(_proto_strict)
    message(FATAL_ERROR
      "${_text}"
      "This is an error since ROSIDL_PROTO_STRICT is set; to build without protobuf types, set ROSIDL_PROTO_SKIP.")
  endif()
  set(_warned "")
  if(CMAKE_SCRIPT_MODE_FILE AND EXISTS "${_proto_output}/refused")
    file(READ "${_proto_output}/refused" _warned)
  endif()
  if("${_warned}" STREQUAL "${_text}")
    message(STATUS "rosidl_generator_proto: ${_proto_package} is built without protobuf types; CMake has warned why")
  else()
    message(WARNING "${_text}" "It is built without them, and so is what needs them.")
    file(WRITE "${_proto_output}/refused" "${_text}")
  endif()
endfunction()

# Runs a command, and sets a variable to whether it succeeded.
function(_rosidl_generator_proto_run succeeded command)
  execute_process(
    COMMAND ${_proto_command} ${command} "@${_proto_output}/arguments" ${ARGN}
    RESULT_VARIABLE _status
    ERROR_VARIABLE _error)
  if("${_status}" STREQUAL "0")
    set(${succeeded} TRUE PARENT_SCOPE)
    file(REMOVE "${_proto_output}/refused")
    if(NOT "${_error}" STREQUAL "")
      message("${_error}")
    endif()
    return()
  endif()
  set(${succeeded} FALSE PARENT_SCOPE)
  if(NOT _status MATCHES "^[0-9]+$")
    list(GET _proto_command 0 _python)
    string(PREPEND _error
      "${_python} cannot be run (${_status}); set ROSIDL_PROTO_PYTHON to a Python that has rosidl_adapter_proto\n")
  endif()
  _rosidl_generator_proto_refuse("${_error}")
endfunction()

# Generates while a package is built. What is skipped leaves nothing of an earlier build, and tells those that need it by
# an empty resource in the ament index.
function(_rosidl_generator_proto_generate)
  _rosidl_generator_proto_run(_succeeded generate)
  if(_succeeded)
    file(REMOVE_RECURSE "${_proto_output}/skipped")
  else()
    file(REMOVE_RECURSE "${_proto_output}/package" "${_proto_output}/dependencies" "${_proto_output}/stamp")
    file(WRITE "${_proto_output}/skipped/rosidl_proto/${_proto_package}" "")
    file(WRITE "${_proto_output}/depfile" "")  # ninja asks for one
  endif()
endfunction()
