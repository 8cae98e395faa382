# `cpack` in a build folder: a Debian package (cpack -G DEB) of headers, CMake files, program, weights, man page and completion; a
# ZIP archive for Windows. For other machines than this one build with -DNPT_NATIVE=OFF, or NPT_MULTI_ISA=ON.
if(TARGET npt_program AND NOT WIN32)
  # From what the program says of itself; where it can't be run (a cross build without emulator) there is none.
  install(CODE "execute_process(COMMAND \"${CMAKE_COMMAND}\" \"-DPROGRAM=${CMAKE_CROSSCOMPILING_EMULATOR};$<TARGET_FILE:npt_program>\"
    \"-DVERSION=${PROJECT_VERSION}\" \"-DOUT=\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1/npt.1\"
    -P \"${CMAKE_CURRENT_LIST_DIR}/packages/man_page.cmake\")")
  install(FILES "${CMAKE_CURRENT_LIST_DIR}/packages/npt.bash" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions" RENAME npt)
endif()
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/npt" RENAME copyright)

set(CPACK_PACKAGE_NAME npt)
set(CPACK_PACKAGE_VENDOR "the npt authors")
set(CPACK_PACKAGE_CONTACT "the npt authors <npt@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
if(WIN32)
  set(CPACK_GENERATOR ZIP)
else()
  set(CPACK_GENERATOR DEB)
  set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
endif()
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libxsimd-dev, libxtensor-dev")  # to compile with the headers
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "libtbb-dev, libtinyobjloader-dev, libeigen3-dev, liblbfgs-dev, bash-completion")
include(CPack)
