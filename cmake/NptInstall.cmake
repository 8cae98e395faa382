# `cmake --install`: the headers, the package for find_package and pkg-config, and what of the program is built. Nothing
# of it depends on the processor but the program and npt::compiled, so the package lies in share.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(npt_package_dir "${CMAKE_INSTALL_DATADIR}/cmake/npt")
install(DIRECTORY "${PROJECT_SOURCE_DIR}/include/npt" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.hpp")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/npt")

install(TARGETS npt npt_reproducible EXPORT npt-targets INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
install(EXPORT npt-targets NAMESPACE npt:: DESTINATION "${npt_package_dir}")
# A file of targets for each other one, since it must not be read where what its target links is missing.
set(npt_parts npt_io npt_draco npt_xtensor npt_lab npt_refine npt_baseline)
if(NPT_INSTALL_COMPILED)
  list(APPEND npt_parts npt_compiled)
endif()
foreach(target IN LISTS npt_parts)
  if(TARGET ${target})
    install(TARGETS ${target} EXPORT ${target}-targets INCLUDES DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
    install(EXPORT ${target}-targets NAMESPACE npt:: DESTINATION "${npt_package_dir}")
  endif()
endforeach()

set(npt_compiled_draco "")
if(TARGET npt_draco)
  set(npt_compiled_draco draco)
endif()
configure_package_config_file("${CMAKE_CURRENT_LIST_DIR}/npt-config.cmake.in" "${PROJECT_BINARY_DIR}/npt-config.cmake"
                              INSTALL_DESTINATION "${npt_package_dir}" NO_SET_AND_CHECK_MACRO)
# Within a major version what is public stays (docs/api.md).
write_basic_package_version_file("${PROJECT_BINARY_DIR}/npt-config-version.cmake" COMPATIBILITY SameMajorVersion
                                 ARCH_INDEPENDENT)
install(FILES "${PROJECT_BINARY_DIR}/npt-config.cmake" "${PROJECT_BINARY_DIR}/npt-config-version.cmake"
              "${CMAKE_CURRENT_LIST_DIR}/NptMultiIsa.cmake" "${CMAKE_CURRENT_LIST_DIR}/FindLBFGS.cmake"
        DESTINATION "${npt_package_dir}")

if(NPT_WITH_TBB)
  set(npt_pc_requires "xsimd tbb")
  set(npt_pc_definitions "")
else()
  set(npt_pc_requires "xsimd")
  set(npt_pc_definitions " -DNPT_NO_TBB")
endif()
configure_file("${CMAKE_CURRENT_LIST_DIR}/npt.pc.in" "${PROJECT_BINARY_DIR}/npt.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/npt.pc" DESTINATION "${CMAKE_INSTALL_DATADIR}/pkgconfig")

if(TARGET npt_program)
  install(TARGETS npt_program RUNTIME)
  install(FILES "${PROJECT_SOURCE_DIR}/examples/npt/render/font/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/npt"
          RENAME LICENSE.DejaVu)  # the font in it
endif()
if(IS_DIRECTORY "${PROJECT_SOURCE_DIR}/examples/weights")
  install(DIRECTORY "${PROJECT_SOURCE_DIR}/examples/weights" DESTINATION "${CMAKE_INSTALL_DATADIR}/npt"
          FILES_MATCHING PATTERN "*.safetensors")
endif()
