# Run by CTest; see CMakeLists.txt for the variables.
function(run what)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what} failed (${result}):\n${output}")
  endif()
endfunction()

file(REMOVE_RECURSE ${WORK})
run("Installing the SDK" ${CMAKE_COMMAND} --install ${BUILD} --prefix ${WORK}/prefix --component sdk)

set(flags "-Wall -Wextra -Werror")
if(SANITIZE)  # the installed libraries need the runtime that they were compiled with
  string(APPEND flags " -fsanitize=${SANITIZE}")
endif()
run("Configuring the example" ${CMAKE_COMMAND} -S ${EXAMPLE} -B ${WORK}/build -G ${GENERATOR} -DCMAKE_CXX_COMPILER=${COMPILER}
    -DCMAKE_PREFIX_PATH=${WORK}/prefix -DCMAKE_CXX_FLAGS=${flags})
run("Building the example" ${CMAKE_COMMAND} --build ${WORK}/build)

# Nothing of the source tree may be needed: the installed files must not name it.
file(GLOB_RECURSE installed ${WORK}/prefix/*.cmake)
foreach(file IN LISTS installed)
  file(READ ${file} text)
  if(text MATCHES "${BUILD}")
    message(FATAL_ERROR "${file} names the build folder")
  endif()
endforeach()

# Without a server it must say so and fail.
execute_process(COMMAND ${WORK}/build/gatefield-minimal 231 RESULT_VARIABLE result ERROR_VARIABLE sentence TIMEOUT 30)
if(result EQUAL 0 OR NOT sentence MATCHES "no planning server answered in DDS domain 231")
  message(FATAL_ERROR "The example ended with ${result} and said: ${sentence}")
endif()
