# Installation. Components, so that a core-only install exists:
#   llmt_core       llmt::llmt and llmt::discovery, their headers and the package files
#   llmt_robotics   llmt::robotics and its headers
#   llmt_libraries  shared libraries, if the libraries are shared; static ones are in the two above
#   llmt_programs   the programs
#   llmt_data       descriptions of known arms
include(CMakePackageConfigHelpers)

set(LLMT_INSTALL_CMAKEDIR "${CMAKE_INSTALL_LIBDIR}/cmake/llmt")

# llmt_install(COMPONENT EXPORT TARGET...)
function(llmt_install component export)
  set(library_component ${component})
  if(BUILD_SHARED_LIBS)
    set(library_component llmt_libraries)
  endif()
  install(
    TARGETS ${ARGN}
    EXPORT ${export}
    RUNTIME COMPONENT ${component}
    LIBRARY COMPONENT ${library_component} NAMELINK_COMPONENT ${component}
    ARCHIVE COMPONENT ${component}
    FILE_SET HEADERS COMPONENT ${component})
  install(
    EXPORT ${export}
    NAMESPACE llmt::
    DESTINATION "${LLMT_INSTALL_CMAKEDIR}"
    COMPONENT ${component})
endfunction()

llmt_install(llmt_core llmtCoreTargets llmt llmt_discovery)
if(TARGET llmt_robotics)
  llmt_install(llmt_robotics llmtRoboticsTargets llmt_robotics)
endif()

# A static library hands its link dependencies on to whoever links it; a shared one does not.
get_target_property(LLMT_LIBRARY_TYPE llmt TYPE)
configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/llmtConfig.cmake.in" "${PROJECT_BINARY_DIR}/llmtConfig.cmake"
                              INSTALL_DESTINATION "${LLMT_INSTALL_CMAKEDIR}" NO_SET_AND_CHECK_MACRO)
# Below 1.0 a minor version may break its users.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/llmtConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
install(
  FILES "${PROJECT_BINARY_DIR}/llmtConfig.cmake" "${PROJECT_BINARY_DIR}/llmtConfigVersion.cmake"
  DESTINATION "${LLMT_INSTALL_CMAKEDIR}"
  COMPONENT llmt_core)

# llmt_pkg_config(COMPONENT NAME DESCRIPTION REQUIRES REQUIRES_PRIVATE): NAME.pc for those who build without CMake. Its paths
# are relative to itself: the prefix is known only when it is installed.
file(RELATIVE_PATH pc_to_prefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
function(llmt_pkg_config component pc_name pc_description pc_requires pc_requires_private)
  # Shared libraries name what they need themselves; pkg-config would ask for its development files.
  if(BUILD_SHARED_LIBS)
    set(pc_requires_private "")
  endif()
  configure_file("${PROJECT_SOURCE_DIR}/cmake/llmt.pc.in" "${PROJECT_BINARY_DIR}/${pc_name}.pc" @ONLY)
  install(
    FILES "${PROJECT_BINARY_DIR}/${pc_name}.pc"
    DESTINATION "${CMAKE_INSTALL_LIBDIR}/pkgconfig"
    COMPONENT ${component})
endfunction()

llmt_pkg_config(llmt_core llmt "Local linear model trees" "eigen3 >= 3.4" "tbb fmt")
llmt_pkg_config(llmt_core llmt_discovery "Which effect a simulation lacks" "eigen3 >= 3.4" "fmt")
if(TARGET llmt_robotics)
  llmt_pkg_config(llmt_robotics llmt_robotics "Robot calibration, and what a robot model lacks" "llmt llmt_discovery"
                  "yaml-cpp muparser urdfdom tinyxml expat fmt")
endif()
