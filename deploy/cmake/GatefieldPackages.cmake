# Debian packages (CPack), one for each of what people install apart. deploy/package builds and checks them.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME gatefield)
set(CPACK_PACKAGE_VENDOR Gatefield)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL server simulator tools sdk data)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "Gatefield developers <developers@gatefield.invalid>")
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)

# gatefield_package(<component> <package> <section> <depends> <one line> <more lines>)
function(gatefield_package component package section depends line description)
  string(TOUPPER ${component} upper)
  foreach(pair "NAME;${package}" "SECTION;${section}" "DEPENDS;${depends}")
    list(GET pair 0 field)
    list(GET pair 1 value)
    set(CPACK_DEBIAN_${upper}_PACKAGE_${field} "${value}" PARENT_SCOPE)
  endforeach()
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${line}\n${description}" PARENT_SCOPE)
  # What Debian's policy wants of every package: copyright, and the changelog (12.5, 12.7).
  set(folder ${CMAKE_INSTALL_DATADIR}/doc/${package})
  install(FILES ${PROJECT_SOURCE_DIR}/deploy/debian/copyright DESTINATION ${folder} COMPONENT ${component})
  install(FILES ${PROJECT_BINARY_DIR}/changelog.Debian.gz DESTINATION ${folder} COMPONENT ${component})
endfunction()

configure_file(${PROJECT_SOURCE_DIR}/deploy/debian/changelog.in ${PROJECT_BINARY_DIR}/changelog.Debian @ONLY)
execute_process(COMMAND gzip -9nf ${PROJECT_BINARY_DIR}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)

set(same_version "gatefield-models (>= ${PROJECT_VERSION})")
gatefield_package(server gatefield-server net "${same_version}, adduser"
  "planning server for drones that race through gates"
  "Takes depth images and vehicle states over DDS and answers with plans: thrust\nrates, or collective thrust and body rates.")
gatefield_package(simulator gatefield-simulator science "${same_version}"
  "simulated quadrotor and gates for a Gatefield server"
  "Flies races through gatefield-server as a vehicle would, alone or with the\nfirmware of a flight controller in its loop.")
gatefield_package(tools gatefield-tools science "gatefield-server, gatefield-simulator, openssl"
  "flight-controller bridge and racing campaigns for Gatefield"
  "gatefield-bridge flies vehicles with Betaflight, PX4 or MAVLink;\ngatefield-race says how often races are won;\ngatefield-keys closes a domain to strangers.")
gatefield_package(sdk gatefield-sdk-dev libdevel "libfastrtps-dev, libfastcdr-dev, libeigen3-dev, libssl-dev"
  "library for clients of a Gatefield server (development files)"
  "Joins a planning server, sends states and depth images, plays plans out, and\nfalls back by itself. A static library with its CMake package.")
gatefield_package(data gatefield-models science ""
  "trained models, courses and vehicles for Gatefield"
  "Networks that see gates in depth images, planner profiles, courses, vehicles\nand scenarios.")
if(GATEFIELD_BUILD_PYTHON)
  # The extension is of one version of Python.
  string(REGEX MATCH "^[0-9]+\\.[0-9]+" this_python "${Python3_VERSION}")
  string(REGEX REPLACE "^[0-9]+\\." "" minor "${this_python}")
  math(EXPR next_minor "${minor} + 1")
  list(APPEND CPACK_COMPONENTS_ALL python)
  gatefield_package(python python3-gatefield python "python3 (>= ${this_python}), python3 (<< 3.${next_minor}), python3-numpy, python3-yaml, ${same_version}"
    "Python client of a Gatefield planning server"
    "Sends depth images and vehicle states as NumPy arrays, gets plans back, and\nplays them out; gatefield-import reads courses and vehicles of other projects.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA
    "${PROJECT_SOURCE_DIR}/deploy/debian/python/postinst;${PROJECT_SOURCE_DIR}/deploy/debian/python/prerm")
endif()
set(CPACK_DEBIAN_DATA_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_DATA_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_SDK_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_SERVER_PACKAGE_CONTROL_EXTRA
  "${PROJECT_SOURCE_DIR}/deploy/debian/postinst;${PROJECT_SOURCE_DIR}/deploy/debian/prerm;${PROJECT_SOURCE_DIR}/deploy/debian/postrm")
include(CPack)
