# Target `tidy`: clang-tidy with the checks of .clang-tidy over the programs, the tests and one unit that includes every
# public header. Needs the packages of `install-dependencies.sh --dev` and tests in the build.
find_program(NPT_CLANG_TIDY NAMES clang-tidy clang-tidy-14)
find_program(NPT_RUN_CLANG_TIDY NAMES run-clang-tidy run-clang-tidy-14)
mark_as_advanced(NPT_CLANG_TIDY NPT_RUN_CLANG_TIDY)
if(NPT_CLANG_TIDY AND NPT_RUN_CLANG_TIDY)
  cmake_host_system_information(RESULT npt_tidy_jobs QUERY NUMBER_OF_LOGICAL_CORES)
  add_custom_target(tidy
    COMMAND "${NPT_RUN_CLANG_TIDY}" -clang-tidy-binary "${NPT_CLANG_TIDY}" -p "${PROJECT_BINARY_DIR}" -quiet -j ${npt_tidy_jobs}
            "^${PROJECT_SOURCE_DIR}/(examples|tests|bench)/" "structure/odr/one\\.cpp$$"
    WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    COMMENT "clang-tidy over headers, programs and tests"
    VERBATIM USES_TERMINAL)
else()
  add_custom_target(tidy
    COMMAND "${CMAKE_COMMAND}" -E echo "tidy: clang-tidy is not installed: run cmake/install-dependencies.sh --dev"
    COMMAND "${CMAKE_COMMAND}" -E false)
endif()
