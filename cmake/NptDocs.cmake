# Target `docs`: the API reference by Doxygen, in BUILD/docs/html. Any warning is an error.
find_program(NPT_DOXYGEN NAMES doxygen)
mark_as_advanced(NPT_DOXYGEN)
if(NOT EXISTS "${PROJECT_SOURCE_DIR}/docs/Doxyfile.in")  # Conan's sources are those that it installs
  return()
endif()
if(NPT_DOXYGEN)
  configure_file("${PROJECT_SOURCE_DIR}/docs/Doxyfile.in" "${PROJECT_BINARY_DIR}/docs/Doxyfile" @ONLY)
  add_custom_target(docs
    COMMAND "${NPT_DOXYGEN}" "${PROJECT_BINARY_DIR}/docs/Doxyfile"
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    COMMENT "API reference in ${PROJECT_BINARY_DIR}/docs/html"
    VERBATIM USES_TERMINAL)
else()
  add_custom_target(docs
    COMMAND "${CMAKE_COMMAND}" -E echo "docs: doxygen is not installed: run cmake/install-dependencies.sh --dev"
    COMMAND "${CMAKE_COMMAND}" -E false)
endif()
