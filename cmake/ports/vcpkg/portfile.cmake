# An overlay port: vcpkg install npt --overlay-ports=cmake/ports/vcpkg, from a clone of npt.
set(SOURCE_PATH "${CMAKE_CURRENT_LIST_DIR}/../../..")
vcpkg_check_features(OUT_FEATURE_OPTIONS options FEATURES tbb NPT_WITH_TBB)
vcpkg_cmake_configure(SOURCE_PATH "${SOURCE_PATH}"
                      OPTIONS ${options} -DNPT_BUILD_PROGRAMS=OFF -DNPT_BUILD_TESTS=OFF -DNPT_INSTALL=ON)
vcpkg_cmake_install()
vcpkg_cmake_config_fixup(CONFIG_PATH share/cmake/npt)
file(REMOVE_RECURSE "${CURRENT_PACKAGES_DIR}/debug")
vcpkg_install_copyright(FILE_LIST "${SOURCE_PATH}/LICENSE")
