# oneDNN as target gatefield_dnnl, where it is installed. Its own CMake file wants OpenCL, which nobody here uses.
find_path(GATEFIELD_DNNL_INCLUDE dnnl.hpp)
find_library(GATEFIELD_DNNL_LIBRARY dnnl)
mark_as_advanced(GATEFIELD_DNNL_INCLUDE GATEFIELD_DNNL_LIBRARY)
if(GATEFIELD_DNNL_INCLUDE AND GATEFIELD_DNNL_LIBRARY AND NOT TARGET gatefield_dnnl)
  add_library(gatefield_dnnl INTERFACE)
  target_include_directories(gatefield_dnnl SYSTEM INTERFACE ${GATEFIELD_DNNL_INCLUDE})
  target_link_libraries(gatefield_dnnl INTERFACE ${GATEFIELD_DNNL_LIBRARY})
endif()
