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
# What of others is in the package, where a program is and Debian's copyright files hold the texts.
find_program(NPT_BASH bash)
mark_as_advanced(NPT_BASH)
if(TARGET npt_program AND NPT_BASH AND EXISTS /etc/debian_version)
  if(WIN32)
    set(npt_notices windows)
  else()
    set(npt_notices deb)
  endif()
  file(MAKE_DIRECTORY "${PROJECT_BINARY_DIR}/package")
  execute_process(COMMAND "${NPT_BASH}" "${CMAKE_CURRENT_LIST_DIR}/packages/notices.sh" ${npt_notices}
                  OUTPUT_FILE "${PROJECT_BINARY_DIR}/package/NOTICE" COMMAND_ERROR_IS_FATAL ANY)
  install(FILES "${PROJECT_BINARY_DIR}/package/NOTICE" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/npt")
endif()

set(CPACK_PACKAGE_NAME npt)
set(CPACK_PACKAGE_VENDOR "the npt authors")
set(NPT_PACKAGE_CONTACT "npt contributors <npt@npt.invalid>" CACHE STRING "Who makes the packages: name and address that stand in them")
set(CPACK_PACKAGE_CONTACT "${NPT_PACKAGE_CONTACT}")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_DESCRIPTION
    "npt puts the pose of one mesh onto another: a program, trained networks,
 and a C++20 library of headers. The two meshes need no rig, no markers and
 no correspondence; clips of one character become animations of another.")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)
if(NPT_NATIVE AND TARGET npt_program)
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/package/native.cmake" CONTENT
       "message(WARNING \"npt: this package's program runs on processors like this one only: -DNPT_NATIVE=OFF, or preset multi-isa\")\n")
  set(CPACK_PROJECT_CONFIG_FILE "${PROJECT_BINARY_DIR}/package/native.cmake")
endif()
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
# Debian wants a changelog of its own form.
if(NOT WIN32)
  string(TIMESTAMP npt_package_date "%a, %d %b %Y %H:%M:%S +0000" UTC)
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/package/changelog" @ONLY CONTENT "npt (@PROJECT_VERSION@) unstable; urgency=medium

  * What is new stands in CHANGELOG.md of the sources.

 -- @NPT_PACKAGE_CONTACT@  @npt_package_date@
")
  file(ARCHIVE_CREATE OUTPUT "${PROJECT_BINARY_DIR}/package/changelog.gz" PATHS "${PROJECT_BINARY_DIR}/package/changelog" FORMAT raw
       COMPRESSION GZip COMPRESSION_LEVEL 9)
  install(FILES "${PROJECT_BINARY_DIR}/package/changelog.gz" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/npt")
endif()
include(CPack)
