# Packages for Debian, by `cpack` in the build folder of the preset `deb`, which builds shared libraries:
#   llmt         the programs, and descriptions of known arms in /usr/share/llmt
#   libllmtX.Y   the libraries
#   libllmt-dev  their headers, the CMake package and pkg-config files
# Dependencies on other libraries are read off the files by dpkg-shlibdeps (Debian package dpkg-dev).
set(CPACK_PACKAGE_NAME llmt)
set(CPACK_PACKAGE_VENDOR "LLMT authors")
set(CPACK_PACKAGE_CONTACT "LLMT authors")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_GENERATOR DEB)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${PROJECT_BINARY_DIR}/llmt" "${PROJECT_BINARY_DIR}/llmt/src/discovery"
                                                "${PROJECT_BINARY_DIR}/robotics")
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)

set(llmt_soversion "${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME llmt)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION science)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME "libllmt${llmt_soversion}")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_DEV_PACKAGE_NAME libllmt-dev)
set(CPACK_DEBIAN_DEV_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEV_PACKAGE_DEPENDS "libeigen3-dev (>= 3.4)")

set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_COMPONENTS_ALL llmt_programs llmt_data llmt_libraries llmt_core llmt_robotics)
set(CPACK_COMPONENT_GROUP_PROGRAMS_DESCRIPTION
    "Local linear model trees: the programs
 llmt learns a model that can be read from a table; llmt-robot calibrates a robot from measured positions, learns what
 its model misses, and names the physical effect behind it.")
set(CPACK_COMPONENT_GROUP_LIBRARY_DESCRIPTION
    "Local linear model trees: the C++ libraries
 Regression by local linear model trees, discovery of missing effects, robot calibration.")
set(CPACK_COMPONENT_GROUP_DEV_DESCRIPTION
    "Local linear model trees: headers
 Headers, CMake package and pkg-config files of the C++ libraries of LLMT.")
include(CPack)
cpack_add_component_group(programs)
cpack_add_component_group(library)
cpack_add_component_group(dev)
cpack_add_component(llmt_programs GROUP programs DEPENDS llmt_libraries)
cpack_add_component(llmt_data GROUP programs)
cpack_add_component(llmt_libraries GROUP library)
cpack_add_component(llmt_core GROUP dev DEPENDS llmt_libraries)
cpack_add_component(llmt_robotics GROUP dev)
