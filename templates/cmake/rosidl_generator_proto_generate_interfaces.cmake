# Runs in rosidl_generate_interfaces(): protobuf types and adapters become part of the package.

if(ROSIDL_PROTO_SKIP)
  message(STATUS "rosidl_generator_proto: skipped, since ROSIDL_PROTO_SKIP is set")
  return()
endif()

_rosidl_generator_proto_arguments(
  "${CMAKE_CURRENT_BINARY_DIR}/rosidl_generator_proto/${rosidl_generate_interfaces_TARGET}")
set(_proto_dependencies "")
set(_proto_descriptions "")
foreach(_package ${rosidl_generate_interfaces_DEPENDENCY_PACKAGE_NAMES})
  get_filename_component(_share "${${_package}_DIR}/.." ABSOLUTE)
  list(APPEND _proto_arguments --dependency "${_share}")
  foreach(_idl_file ${${_package}_IDL_FILES})
    list(APPEND _proto_dependencies "${_share}/${_idl_file}")
    string(REGEX REPLACE "\\.idl$" ".json" _description "${_share}/${_idl_file}")
    if(EXISTS "${_description}")
      list(APPEND _proto_descriptions "${_description}")
    endif()
  endforeach()
endforeach()
_rosidl_generator_proto_run(check)

if(POLICY CMP0116)
  cmake_policy(SET CMP0116 NEW)
endif()
add_custom_command(
  OUTPUT "${_proto_output}/stamp"
  COMMAND ${_proto_command} generate "@${_proto_arguments_file}"
  DEPENDS ${_proto_definitions} ${_proto_dependencies} "${_proto_arguments_file}"
  DEPFILE "${_proto_output}/depfile"
  COMMENT "Generating protobuf types and adapters"
  VERBATIM)
add_custom_target(
  ${rosidl_generate_interfaces_TARGET}__rosidl_generator_proto ALL DEPENDS "${_proto_output}/stamp")
add_dependencies(
  ${rosidl_generate_interfaces_TARGET} ${rosidl_generate_interfaces_TARGET}__rosidl_generator_proto)

# Type hashes cover messages of other packages too, but ROS does not make them anew when one of those has changed. Our
# adapters would then be right, and refused for it.
if(TARGET ${rosidl_generate_interfaces_TARGET}__rosidl_generator_type_description)
  list(GET rosidl_generate_interfaces_ABS_IDL_FILES 0 _idl_file)
  get_filename_component(_folder "${_idl_file}" DIRECTORY)
  get_filename_component(_folder "${_folder}" NAME)
  get_filename_component(_name "${_idl_file}" NAME_WE)
  add_custom_command(
    OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/rosidl_generator_type_description/${PROJECT_NAME}/${_folder}/${_name}.json"
    APPEND DEPENDS ${_proto_descriptions})
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
  # Packages that are built at the same time may have the same dependencies: CMake would stumble over its own copies.
  list(JOIN _proto_command "\" \"" _proto_install)
  install(CODE "
    execute_process(
      COMMAND \"${_proto_install}\" install \"@${_proto_arguments_file}\"
        --prefix \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}\" --python-folder \"${_proto_python_install_dir}\"
      RESULT_VARIABLE _proto_result)
    if(NOT _proto_result EQUAL 0)
      message(FATAL_ERROR \"rosidl_generator_proto: the dependencies of ${PROJECT_NAME} cannot be installed\")
    endif()")
endif()
message(STATUS "rosidl_generator_proto: ${PROJECT_NAME} gets protobuf types and adapters")
