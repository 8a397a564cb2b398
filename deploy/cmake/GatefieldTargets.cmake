# One way to declare targets, so that warnings, the language level and sanitizers are the same everywhere.

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

find_program(GATEFIELD_CCACHE ccache)
if(GATEFIELD_CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${GATEFIELD_CCACHE})
endif()

# Flags that every target of ours gets; third-party headers come in as SYSTEM and are spared.
add_library(gatefield_flags INTERFACE)
# -fno-math-errno lets loops over sqrt vectorise; results stay IEEE (no -ffast-math: bit-exact replay depends on it).
# -ffp-contract=off keeps scalar code equal whichever translation unit it is compiled in.
target_compile_options(gatefield_flags INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion -fno-math-errno -ffp-contract=off)
if(GATEFIELD_SANITIZE)
  target_compile_options(gatefield_flags INTERFACE -fsanitize=${GATEFIELD_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(gatefield_flags INTERFACE -fsanitize=${GATEFIELD_SANITIZE})
endif()

# gatefield_library(<name> [SOURCES ...] [PUBLIC ...] [PRIVATE ...])
# A static library (INTERFACE when it has no sources) that includes by paths from the repository's root.
function(gatefield_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  if(ARG_SOURCES)
    add_library(${name} STATIC ${ARG_SOURCES})
    target_include_directories(${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
    target_link_libraries(${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:gatefield_flags>)
  else()
    add_library(${name} INTERFACE)
    target_include_directories(${name} INTERFACE $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>)
    target_link_libraries(${name} INTERFACE ${ARG_PUBLIC})
  endif()
endfunction()

# gatefield_program(<name> SOURCES ... LIBRARIES ...): a program for people, in <build>/bin
function(gatefield_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LIBRARIES" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} gatefield_flags)
endfunction()

# Everything that carries a label, so that a sanitizer build can make just that: cmake --build ... --target unit_tests
add_custom_target(unit_tests)
add_custom_target(thread_tests)

# gatefield_test(<name> LABEL <unit|integration|conformance|...> SOURCES ... LIBRARIES ... [TIMEOUT s] [THREADS])
# One GoogleTest executable, one CTest test per executable. THREADS: also run under ThreadSanitizer (label threads).
function(gatefield_test name)
  cmake_parse_arguments(ARG "THREADS" "LABEL;TIMEOUT" "SOURCES;LIBRARIES" ${ARGN})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  add_executable(${name} ${ARG_SOURCES})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE ${ARG_LIBRARIES} GTest::gmock GTest::gtest_main gatefield_flags)
  target_compile_definitions(${name} PRIVATE GATEFIELD_SOURCE_DIR="${PROJECT_SOURCE_DIR}" GATEFIELD_BINARY_DIR="${PROJECT_BINARY_DIR}")
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
