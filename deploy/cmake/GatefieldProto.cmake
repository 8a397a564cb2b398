# gatefield_proto_library(<name> [TRUTH] PROTOS <files relative to the current folder> [PUBLIC <other proto libraries>])
# Generates C++ from protobuf schemas into the build tree. Schemas import each other, and code includes them, by paths from the
# repository's root: "common/config/vehicle.proto" becomes "common/config/vehicle.pb.h". Generated code is no code of ours, so it
# is spared our warnings. Each library generates into a folder of its own, so that its headers are seen by what links it only.
find_package(Protobuf 3.21 REQUIRED)

function(gatefield_proto_library name)
  cmake_parse_arguments(ARG "TRUTH" "" "PROTOS;PUBLIC" ${ARGN})
  set(out ${PROJECT_BINARY_DIR}/generated/${name})
  file(MAKE_DIRECTORY ${out})
  file(RELATIVE_PATH folder ${PROJECT_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(sources)
  foreach(proto IN LISTS ARG_PROTOS)
    get_filename_component(stem ${proto} NAME_WE)
    set(made ${out}/${folder}/${stem}.pb.cc ${out}/${folder}/${stem}.pb.h)
    add_custom_command(
      OUTPUT ${made}
      COMMAND protobuf::protoc --cpp_out=${out} --proto_path=${PROJECT_SOURCE_DIR} ${folder}/${proto}
      WORKING_DIRECTORY ${PROJECT_SOURCE_DIR}
      DEPENDS ${ARG_PROTOS} # they may import each other
      COMMENT "protoc ${folder}/${proto}"
      VERBATIM)
    list(APPEND sources ${made})
  endforeach()
  add_library(${name} STATIC ${sources})
  target_include_directories(${name} SYSTEM PUBLIC $<BUILD_INTERFACE:${out}>)
  target_link_libraries(${name} PUBLIC protobuf::libprotobuf ${ARG_PUBLIC})
  add_dependencies(generated_code ${name})
  if(ARG_TRUTH)
    gatefield_mark_truth(${name})
  endif()
  if(GATEFIELD_SANITIZE)
    target_compile_options(${name} PRIVATE -fsanitize=${GATEFIELD_SANITIZE} -fno-omit-frame-pointer)
  endif()
endfunction()
