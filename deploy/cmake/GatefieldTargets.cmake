# One way to declare targets, so that warnings, the language level and sanitizers are the same everywhere.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

find_program(GATEFIELD_CCACHE ccache)
if(GATEFIELD_CCACHE)
  # What it needs to know of precompiled headers, which tests have.
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros ${GATEFIELD_CCACHE})
endif()

# Flags that every target of ours gets; third-party headers come in as SYSTEM and are spared.
add_library(gatefield_flags INTERFACE)
# -fno-math-errno lets loops over sqrt vectorise; results stay IEEE (no -ffast-math: bit-exact replay depends on it).
# -ffp-contract=off keeps scalar code equal whichever translation unit it is compiled in.
# -Wno-restrict: GCC 12 warns of its own std::string at "literal" + std::string (its bug 105651).
target_compile_options(gatefield_flags INTERFACE
  -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -Wno-restrict -fno-math-errno -ffp-contract=off)
if(GATEFIELD_SANITIZE)
  target_compile_options(gatefield_flags INTERFACE
    -fsanitize=${GATEFIELD_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(gatefield_flags INTERFACE -fsanitize=${GATEFIELD_SANITIZE})
  if(GATEFIELD_SANITIZE_NOT)
    target_compile_options(gatefield_flags INTERFACE -fno-sanitize=${GATEFIELD_SANITIZE_NOT})
  endif()
  if(GATEFIELD_SANITIZE MATCHES "address")
    # Eigen would pad its blocks itself, and libpagmo, which is built without a sanitizer, gives them back with free().
    target_compile_definitions(gatefield_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
  endif()
endif()

include(GatefieldWalls)

# gatefield_library(<name> [TRUTH] [OBJECT] [SOURCES ...] [HEADERS ...] [PUBLIC ...] [PRIVATE ...])
# A static library (OBJECT: its objects, all of which go into what links it; INTERFACE when it has no sources). Includes are
# written as paths from the repository's root; which of them are found follows from the links (GatefieldWalls.cmake, which
# also says what HEADERS and TRUTH are for).
function(gatefield_library name)
  cmake_parse_arguments(ARG "TRUTH;OBJECT" "" "SOURCES;HEADERS;PUBLIC;PRIVATE" ${ARGN})
  gatefield_wall_folder(headers include ${name})
  gatefield_wall_folder(inside inside ${name})
  if(ARG_SOURCES)
    set(kind STATIC)
    if(ARG_OBJECT)
      set(kind OBJECT)
    endif()
    add_library(${name} ${kind} ${ARG_SOURCES})
    target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${headers}> PRIVATE ${inside})
    target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:gatefield_flags>)
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE $<BUILD_INTERFACE:${headers}>)
    target_link_libraries(${name} INTERFACE ${ARG_PUBLIC})
  endif()
  set_target_properties(${name} PROPERTIES GATEFIELD_HEADERS "${ARG_HEADERS}")
  gatefield_register_owner(library ${name})
  if(ARG_TRUTH)
    gatefield_mark_truth(${name})
  endif()
endfunction()

# What programs and tests have in common: the headers of their own folder, and what they link.
function(gatefield_executable name sources libraries inside)
  add_executable(${name} ${sources})
  gatefield_wall_folder(headers include ${name})
  target_include_directories(${name} PRIVATE ${headers})
  target_link_libraries(${name} PRIVATE ${libraries} gatefield_flags)
  gatefield_register_owner(program ${name})
  foreach(library IN LISTS inside)
    gatefield_wall_folder(folder inside ${library})
    target_include_directories(${name} PRIVATE ${folder})
  endforeach()
endfunction()

# gatefield_program(<name> [BLIND] SOURCES ... LIBRARIES ...): a program for people, in <build>/bin
# BLIND: it must not link what knows the truth.
function(gatefield_program name)
  cmake_parse_arguments(ARG "BLIND" "" "SOURCES;LIBRARIES" ${ARGN})
  gatefield_executable(${name} "${ARG_SOURCES}" "${ARG_LIBRARIES}" "")
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
  if(ARG_BLIND)
    # When everything has been read: a link may be added after this line.
    cmake_language(EVAL CODE "cmake_language(DEFER DIRECTORY [[${PROJECT_SOURCE_DIR}]] CALL gatefield_check_blind ${name})")
  endif()
endfunction()

# Code that is made while building, for what reads sources without compiling them (deploy/lint).
add_custom_target(generated_code)

# Everything that carries a label, so that a sanitizer build can make just that: cmake --build ... --target unit_tests
add_custom_target(unit_tests)
add_custom_target(thread_tests)

# What nearly every test reads, compiled once: 2.7 s of 4 for each source. Tests alone, so that what we ship names its own
# headers; an executable, since flags have to be the same as theirs.
function(gatefield_test_headers)
  set(source ${PROJECT_BINARY_DIR}/test_headers.cpp)
  file(GENERATE OUTPUT ${source} CONTENT "int main() {}\n")
  add_executable(gatefield_test_headers EXCLUDE_FROM_ALL ${source})
  target_link_libraries(gatefield_test_headers PRIVATE Eigen3::Eigen GTest::gmock gatefield_flags)
  target_compile_options(gatefield_test_headers PRIVATE ${gatefield_test_options})
  target_precompile_headers(gatefield_test_headers PRIVATE <gmock/gmock.h> <gtest/gtest.h> <Eigen/Dense> <Eigen/Geometry>
    <algorithm> <array> <atomic> <chrono> <cmath> <cstdint> <filesystem> <functional> <map> <memory> <mutex> <optional>
    <random> <string> <string_view> <thread> <utility> <vector>)
endfunction()
# A test's own code need not be fast: -O1 compiles it in two thirds of the time. What it tests stays as it is.
set(gatefield_test_options $<$<CONFIG:Release>:-O1> $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)

# gatefield_test(<name> LABEL <unit|integration|conformance|...> SOURCES ... LIBRARIES ... [INSIDE ...] [TIMEOUT s] [THREADS])
# One GoogleTest executable, one CTest test per executable. THREADS: also run under ThreadSanitizer (label threads).
# INSIDE: libraries whose inner parts (*-inl.h) it tests.
function(gatefield_test name)
  cmake_parse_arguments(ARG "THREADS" "LABEL;TIMEOUT" "SOURCES;LIBRARIES;INSIDE" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  if(NOT TARGET gatefield_test_headers)
    gatefield_test_headers()
  endif()
  gatefield_executable(${name} "${ARG_SOURCES}" "${ARG_LIBRARIES};Eigen3::Eigen;GTest::gmock;GTest::gtest_main" "${ARG_INSIDE}")
  target_compile_options(${name} PRIVATE ${gatefield_test_options})
  target_precompile_headers(${name} REUSE_FROM gatefield_test_headers)
  target_compile_definitions(${name} PRIVATE
    GATEFIELD_SOURCE_DIR="${PROJECT_SOURCE_DIR}" GATEFIELD_BINARY_DIR="${PROJECT_BINARY_DIR}")
  add_test(NAME ${name} COMMAND ${name})
  set(labels ${ARG_LABEL})
  if(ARG_LABEL STREQUAL "unit")
    add_dependencies(unit_tests ${name})
  endif()
  if(ARG_THREADS)
    add_dependencies(thread_tests ${name})
    list(APPEND labels threads)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS "${labels}" TIMEOUT ${ARG_TIMEOUT})
endfunction()

# gatefield_python_test(<name> LABEL <unit|integration> FOLDER <folder> [TIMEOUT s])
# The test_*.py of a folder, run by pytest against the package in the build tree; left out where pytest or NumPy isn't there.
function(gatefield_python_test name)
  cmake_parse_arguments(ARG "" "LABEL;FOLDER;TIMEOUT" "" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  execute_process(COMMAND ${Python3_EXECUTABLE} -c "import numpy, pytest" RESULT_VARIABLE missing OUTPUT_QUIET ERROR_QUIET)
  if(missing)
    message(STATUS "${name} is left out: ${Python3_EXECUTABLE} has no NumPy or no pytest (deploy/install python test)")
    return()
  endif()
  add_test(NAME ${name} COMMAND ${Python3_EXECUTABLE} -m pytest -q -p no:cacheprovider ${ARG_FOLDER})
  set(environment PYTHONPATH=${PROJECT_BINARY_DIR}/python:${PROJECT_SOURCE_DIR}/client/python/examples PYTHONDONTWRITEBYTECODE=1
    GATEFIELD_SOURCE_DIR=${PROJECT_SOURCE_DIR} GATEFIELD_BINARY_DIR=${PROJECT_BINARY_DIR})
  if(GATEFIELD_SANITIZE MATCHES "address")
    # Its library has to be there before the interpreter, which never frees all that it took, and the one of C++ with it:
    # what throws is looked up there and then.
    foreach(file libasan.so libstdc++.so.6)
      execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=${file} OUTPUT_VARIABLE library
        OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
      list(APPEND libraries ${library})
    endforeach()
    list(JOIN libraries ":" libraries)
    list(APPEND environment LD_PRELOAD=${libraries} ASAN_OPTIONS=detect_leaks=0:new_delete_type_mismatch=0)
  endif()
  set_tests_properties(${name} PROPERTIES LABELS ${ARG_LABEL} TIMEOUT ${ARG_TIMEOUT} ENVIRONMENT "${environment}")
  if(ARG_LABEL STREQUAL "unit")
    add_dependencies(unit_tests gatefield_python)
  endif()
endfunction()
