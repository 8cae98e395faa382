# NPT_MULTI_ISA: the program for every x86-64 processor. It is compiled once for each instruction set of npt_add_multi_isa, as a
# program of its own (lib/npt/npt-SET), and bin/npt starts the best that the processor has. Four builds of the program, so this is
# for packages: cmake --preset multi-isa && cmake --build --preset multi-isa && (cd build/multi-isa && cpack)
include(ExternalProject)
include(GNUInstallDirs)

set(NPT_MULTI_ISA_SETS sse2 avx2 avx512 avx512bf16 CACHE STRING "Instruction sets of the program, the oldest first")
set(npt_sets "")
foreach(isa IN LISTS NPT_MULTI_ISA_SETS)
  npt_isa_flags(flags ${isa})
  list(JOIN flags " " flags)
  ExternalProject_Add(npt_program_${isa}
    SOURCE_DIR "${PROJECT_SOURCE_DIR}" BINARY_DIR "${PROJECT_BINARY_DIR}/${isa}" PREFIX "${PROJECT_BINARY_DIR}/external"
    CMAKE_ARGS -DCMAKE_BUILD_TYPE=${CMAKE_BUILD_TYPE} -DCMAKE_CXX_COMPILER=${CMAKE_CXX_COMPILER} -DNPT_NATIVE=OFF
               -DNPT_WITH_TBB=${NPT_WITH_TBB} -DNPT_BUILD_TESTS=OFF -DNPT_INSTALL=OFF "-DCMAKE_CXX_FLAGS=${CMAKE_CXX_FLAGS} -march=x86-64 ${flags}"
    BUILD_COMMAND "${CMAKE_COMMAND}" --build <BINARY_DIR> --target npt_program
    COMMAND "${CMAKE_COMMAND}" -E copy <BINARY_DIR>/bin/npt "${PROJECT_BINARY_DIR}/lib/npt/npt-${isa}"
    COMMAND "${CMAKE_STRIP}" "${PROJECT_BINARY_DIR}/lib/npt/npt-${isa}"  # cpack strips targets alone
    INSTALL_COMMAND "" BUILD_ALWAYS ON USES_TERMINAL_BUILD ON)
  npt_isa_condition(condition ${isa})
  string(PREPEND npt_sets "{\"${isa}\", ${condition}}, ")
  install(PROGRAMS "${PROJECT_BINARY_DIR}/lib/npt/npt-${isa}" DESTINATION lib/npt)
endforeach()

file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/npt_sets.hpp" CONTENT "#define NPT_SETS @npt_sets@\n" @ONLY)
add_executable(npt_program examples/launcher/launcher.cpp)
set_target_properties(npt_program PROPERTIES OUTPUT_NAME npt RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
target_compile_features(npt_program PRIVATE cxx_std_20)
target_compile_options(npt_program PRIVATE -march=x86-64 -Wall -Wextra -include "${PROJECT_BINARY_DIR}/npt_sets.hpp")
foreach(isa IN LISTS NPT_MULTI_ISA_SETS)
  add_dependencies(npt_program npt_program_${isa})
endforeach()
