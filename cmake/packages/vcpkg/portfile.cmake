# An overlay port of this checkout: vcpkg install llmt --overlay-ports=cmake/packages/vcpkg
get_filename_component(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
vcpkg_check_features(OUT_FEATURE_OPTIONS features FEATURES programs LLMT_BUILD_APPS)
vcpkg_cmake_configure(
  SOURCE_PATH "${SOURCE_PATH}"
  OPTIONS -DLLMT_BUILD_TESTING=OFF -DLLMT_BUILD_BENCHMARKS=OFF -DLLMT_UNITY_BUILD=ON ${features})
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH lib/cmake/llmt)
vcpkg_fixup_pkgconfig()
vcpkg_copy_pdbs()
if("programs" IN_LIST FEATURES)
  vcpkg_copy_tools(TOOL_NAMES llmt llmt-robot AUTO_CLEAN)
endif()
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug/include" "${CURRENT_PACKAGES_DIR}/debug/share")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
