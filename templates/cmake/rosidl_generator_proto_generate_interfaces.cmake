# Runs in rosidl_generate_interfaces(): protobuf types and adapters become part of the package.

if(ROSIDL_PROTO_SKIP)
  message(STATUS "rosidl_generator_proto: skipped, since ROSIDL_PROTO_SKIP is set")
  return()
endif()

_rosidl_generator_proto_arguments(
  "${CMAKE_CURRENT_BINARY_DIR}/rosidl_generator_proto/${rosidl_generate_interfaces_TARGET}")
if(NOT _interface_tuples)
  _rosidl_generator_proto_refuse("This version of ROS does not tell which definitions it got (in _interface_tuples).")
  return()
endif()
if(NOT COMMAND ament_get_python_install_dir)
  _rosidl_generator_proto_refuse("ament_cmake_python was not found, which says where Python packages are installed.")
  return()
endif()

set(_proto_dependencies "")
set(_proto_descriptions "")
foreach(_proto_dependency ${rosidl_generate_interfaces_DEPENDENCY_PACKAGE_NAMES})
  get_filename_component(_proto_share "${${_proto_dependency}_DIR}/.." ABSOLUTE)
  list(APPEND _proto_arguments --dependency "${_proto_share}")
  foreach(_proto_file ${${_proto_dependency}_IDL_FILES})
    string(REGEX REPLACE "\\.idl$" ".json" _proto_description "${_proto_share}/${_proto_file}")
    if(EXISTS "${_proto_share}/${_proto_file}")
      list(APPEND _proto_dependencies "${_proto_share}/${_proto_file}")
    endif()
    if(EXISTS "${_proto_description}")
      list(APPEND _proto_descriptions "${_proto_description}")
    endif()
  endforeach()
endforeach()
_rosidl_generator_proto_write_arguments()

# What cannot be served is said before ROS's generators run, and tried again in each build: it may have been mended.
get_property(_proto_refused GLOBAL PROPERTY _rosidl_generator_proto_refused)
if(_proto_refused STREQUAL "${_interface_tuples}")
  file(COPY "${CMAKE_CURRENT_BINARY_DIR}/rosidl_generator_proto/refused" DESTINATION "${_proto_output}")
else()
  _rosidl_generator_proto_run(_proto_succeeded check)
endif()

file(CONFIGURE OUTPUT "${_proto_output}/settings.cmake" @ONLY CONTENT [[
cmake_minimum_required(VERSION 3.20)
set(_proto_package "@_proto_package@")
set(_proto_strict "@_proto_strict@")
set(_proto_output "@_proto_output@")
set(_proto_command "@_proto_command@")
include("@CMAKE_CURRENT_LIST_DIR@/rosidl_generator_proto_run.cmake")
]])
file(CONFIGURE OUTPUT "${_proto_output}/generate.cmake" @ONLY CONTENT [[
include("@_proto_output@/settings.cmake")
_rosidl_generator_proto_generate()
]])

if(POLICY CMP0116)
  cmake_policy(SET CMP0116 NEW)
endif()
add_custom_command(
  OUTPUT "${_proto_output}/stamp"
  COMMAND "${CMAKE_COMMAND}" -P "${_proto_output}/generate.cmake"
  DEPENDS
    ${_proto_definitions} ${_proto_dependencies} "${_proto_output}/arguments" "${_proto_output}/settings.cmake"
  DEPFILE "${_proto_output}/depfile"
  COMMENT "Generating protobuf types and adapters"
  VERBATIM)
add_custom_target(
  ${rosidl_generate_interfaces_TARGET}__rosidl_generator_proto ALL DEPENDS "${_proto_output}/stamp")
add_dependencies(
  ${rosidl_generate_interfaces_TARGET} ${rosidl_generate_interfaces_TARGET}__rosidl_generator_proto)

# Type hashes cover messages of other packages too, but ROS does not make them anew when one of those has changed. Our
# adapters would then be right, and refused for it.
if(${rosidl_generate_interfaces_TARGET}__DESCRIPTION_TUPLES)
  list(GET ${rosidl_generate_interfaces_TARGET}__DESCRIPTION_TUPLES 0 _proto_description)
  string(REGEX REPLACE "^[^:]*:" "" _proto_description "${_proto_description}")
  add_custom_command(OUTPUT "${_proto_description}" APPEND DEPENDS ${_proto_descriptions})
endif()

if(NOT rosidl_generate_interfaces_SKIP_INSTALL)
  _ament_cmake_python_register_environment_hook()
  ament_get_python_install_dir(_proto_python_install_dir)
  # Folders and where they go, as in rosidl_adapter_proto/generate/outputs.py.
  foreach(_proto_place
      "proto:share"
      "python:${_proto_python_install_dir}"
      "index:share/ament_index/resource_index")
    string(REGEX MATCH "^([^:]+):(.+)$" _proto_place "${_proto_place}")
    install(
      DIRECTORY "${_proto_output}/package/${CMAKE_MATCH_1}/"
      DESTINATION "${CMAKE_MATCH_2}"
      OPTIONAL
      PATTERN "__pycache__" EXCLUDE)
  endforeach()
  install(DIRECTORY "${_proto_output}/skipped/" DESTINATION "share/ament_index/resource_index" OPTIONAL)
  # Packages that are built at the same time may have the same dependencies: CMake would stumble over its own copies.
  install(CODE "
    include(\"${_proto_output}/settings.cmake\")
    _rosidl_generator_proto_run(_succeeded install
      --prefix \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}\" --python-folder \"${_proto_python_install_dir}\")")
endif()
if(NOT EXISTS "${_proto_output}/refused")
  message(STATUS "rosidl_generator_proto: ${PROJECT_NAME} gets protobuf types and adapters")
endif()
