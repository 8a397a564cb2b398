# Configures a copy of FROM and expects that it stops. Run by CTest; see CMakeLists.txt for the variables.
file(REMOVE_RECURSE ${WORK})
file(COPY ${FROM}/ DESTINATION ${WORK}/source)
file(WRITE ${WORK}/source/header.h "")
execute_process(COMMAND ${CMAKE_COMMAND} -S ${WORK}/source -B ${WORK}/build -DCASE=${CASE} -DWALLS=${WALLS}
                RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE words)
string(REGEX REPLACE "[ \n]+" " " words "${words}") # CMake breaks its sentences into lines
if(result EQUAL 0)
  message(FATAL_ERROR "The configuration of '${CASE}' went through and should have stopped.")
elseif(NOT words MATCHES "${SENTENCE}")
  message(FATAL_ERROR "The configuration of '${CASE}' should have stopped with '${SENTENCE}' and said:\n${words}")
endif()
