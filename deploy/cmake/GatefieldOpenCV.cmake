# gatefield_find_opencv(<module>...): makes targets gatefield_opencv_<module> from Debian's libopencv-<module>-dev packages.
# These have no CMake config file; that one comes with libopencv-dev, which pulls in some 200 packages that nothing here needs.
function(gatefield_find_opencv)
  find_path(GATEFIELD_OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4 REQUIRED)
  foreach(module IN LISTS ARGN)
    if(TARGET gatefield_opencv_${module})
      continue()
    endif()
    find_library(GATEFIELD_OPENCV_${module} opencv_${module} REQUIRED)
    add_library(gatefield_opencv_${module} INTERFACE IMPORTED GLOBAL)
    target_include_directories(gatefield_opencv_${module} SYSTEM INTERFACE ${GATEFIELD_OPENCV_INCLUDE})
    target_link_libraries(gatefield_opencv_${module} INTERFACE ${GATEFIELD_OPENCV_${module}})
  endforeach()
endfunction()
