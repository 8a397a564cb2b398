# Run by CTest; see CMakeLists.txt for the variables.
cmake_minimum_required(VERSION 3.25)

function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what} failed (${result}):\n${output}")
  endif()
endfunction()

set(flags "-Wall -Wextra -Werror")
if(SANITIZE)  # the installed libraries need the runtime that they were compiled with
  string(APPEND flags " -fsanitize=${SANITIZE}")
endif()
function(configure source build more_flags)
  run("Configuring ${source}" ${CMAKE_COMMAND} -S ${source} -B ${WORK}/${build} -G ${GENERATOR} -DCMAKE_BUILD_TYPE=Release
      -DCMAKE_CXX_COMPILER=${COMPILER} -DCMAKE_PREFIX_PATH=${prefix} "-DCMAKE_CXX_FLAGS=${flags} ${more_flags}")
endfunction()

file(REMOVE_RECURSE ${WORK})
# The Debian package is what is tried, unpacked into a folder of its own: gatefield-sdk-dev alone, without dpkg's database.
run("Packaging the SDK" ${CPACK} --config ${BUILD}/CPackConfig.cmake -G DEB -D CPACK_COMPONENTS_ALL=sdk -B ${WORK}/package)
file(GLOB package ${WORK}/package/gatefield-sdk-dev_*.deb)
run("Unpacking ${package}" dpkg-deb -x ${package} ${WORK}/root)
set(prefix ${WORK}/root/usr)

# Nothing of the source tree may be needed: the installed files must not name it.
file(GLOB_RECURSE installed ${prefix}/*.cmake ${prefix}/*.h)
foreach(file IN LISTS installed)
  file(READ ${file} text)
  if(text MATCHES "${BUILD}")
    message(FATAL_ERROR "${file} names the build folder")
  endif()
endforeach()

# Headers lie under gatefield/ only, and include each other by that name.
file(GLOB beside RELATIVE ${prefix}/include ${prefix}/include/*)
if(NOT beside STREQUAL "gatefield")
  message(FATAL_ERROR "Installed into include/: ${beside}, expected gatefield alone")
endif()
file(GLOB_RECURSE headers ${prefix}/include/*.h)
foreach(header IN LISTS headers)
  file(STRINGS ${header} quoted REGEX "#include \"")
  if(quoted)
    message(FATAL_ERROR "${header} has ${quoted}, expected <gatefield/...>")
  endif()
endforeach()
file(READ ${prefix}/lib/cmake/gatefield/gatefieldTargets.cmake targets)
if(targets MATCHES "INTERFACE_INCLUDE_DIRECTORIES [^\n]*include/gatefield")
  message(FATAL_ERROR "A target of the package gives its users include/gatefield as a folder to search")
endif()

set(examples minimal motion_capture one_gate rates)
find_library(librealsense realsense2)
if(librealsense)
  list(APPEND examples realsense)
else()
  message(STATUS "examples/realsense is left out: librealsense 2 is not here")
endif()
foreach(example IN LISTS examples)
  configure(${EXAMPLES}/${example} ${example} "")
  run("Building ${example}" ${CMAKE_COMMAND} --build ${WORK}/${example})
endforeach()

# Without a server it must say so and fail.
execute_process(COMMAND ${WORK}/minimal/gatefield-minimal 231 RESULT_VARIABLE result ERROR_VARIABLE sentence TIMEOUT 30)
if(result EQUAL 0 OR NOT sentence MATCHES "no planning server answered in DDS domain 231")
  message(FATAL_ERROR "The example ended with ${result} and said: ${sentence}")
endif()

# One layout whatever the user's flags: the same numbers of every struct of the interface, and a state that arrives as it was sent.
set(number 0)
foreach(more "" -march=native "-mavx512f -mfma")
  math(EXPR number "${number} + 1")
  separate_arguments(words UNIX_COMMAND "${more}")
  execute_process(COMMAND ${COMPILER} ${words} -x c++ -E /dev/null RESULT_VARIABLE result OUTPUT_QUIET ERROR_QUIET)
  if(NOT result EQUAL 0)
    continue()  # of another processor family
  endif()
  configure(${LAYOUT} layout-${number} "${more}")
  run("Building with '${more}'" ${CMAKE_COMMAND} --build ${WORK}/layout-${number})
  if(more MATCHES avx512f)
    continue()  # linking says enough; this machine may not have it
  endif()
  run("A state over DDS with '${more}'" ${ECHO} ${WORK}/layout-${number}/gatefield-layout)
endforeach()

# A layout that does differ must not link, and the linker's message must say why.
configure(${LAYOUT} other-layout "-D_GLIBCXX_DEBUG")
execute_process(COMMAND ${CMAKE_COMMAND} --build ${WORK}/other-layout RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0 OR NOT output MATCHES "undefined reference to [^\n]*connect_if_layouts_agree")
  message(FATAL_ERROR "A client with the debug containers was built (${result}), expected a link error that names connect_if_layouts_agree:\n${output}")
endif()
