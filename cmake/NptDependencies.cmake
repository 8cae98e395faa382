# Finds what the headers, programs and tests need, and names the Debian packages of everything missing at once.

# npt_need(PACKAGE DEBIAN_PACKAGE): find_package, whose failure is remembered instead of ending the run. A macro,
# because packages set variables in the scope that finds them.
macro(npt_need package debian_package)
  find_package(${package} QUIET)
  if(NOT ${package}_FOUND)
    list(APPEND npt_missing_packages ${debian_package})
  endif()
endmacro()

# What is found here is linked by targets of the project that adds this one.
set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)
set(npt_missing_packages "")
find_package(Threads REQUIRED)
# xsimd's target of Debian 12 links xtl without finding it, hence xtl first.
npt_need(xtl libxtensor-dev)
npt_need(xsimd libxsimd-dev)
if(NPT_WITH_TBB)
  npt_need(TBB libtbb-dev)
endif()
if(NPT_BUILD_PROGRAMS OR NPT_BUILD_TESTS OR NPT_BUILD_BENCHMARKS)
  npt_need(xtensor libxtensor-dev)
  npt_need(tinyobjloader libtinyobjloader-dev)
else()
  find_package(xtensor QUIET)
  find_package(tinyobjloader QUIET)
endif()
if(NPT_BUILD_PROGRAMS)
  npt_need(CLI11 libcli11-dev)
  npt_need(nlohmann_json nlohmann-json3-dev)
  find_path(NPT_STB_INCLUDE_DIR stb/stb_image_write.h DOC "Folder that holds stb/stb_image_write.h")
  mark_as_advanced(NPT_STB_INCLUDE_DIR)
  if(NOT NPT_STB_INCLUDE_DIR)
    list(APPEND npt_missing_packages libstb-dev)
  endif()
endif()
# Optional: without it glTF that Draco compressed is refused.
find_package(draco QUIET)
# Optional, for the program: without it FBX, Collada and STL are refused.
if(NPT_BUILD_PROGRAMS)
  find_package(assimp QUIET)
  if(NOT TARGET assimp::assimp AND PROJECT_IS_TOP_LEVEL)
    message(STATUS "npt: assimp is missing (libassimp-dev): the program refuses FBX, Collada and STL files")
  endif()
endif()
# Optional: without them the refinement of results and transfer without networks, their commands and their tests are
# left out.
find_package(Eigen3 QUIET NO_MODULE)
find_package(LBFGS QUIET)
if(NPT_WITH_MPI)
  find_package(MPI QUIET COMPONENTS CXX)
  if(NOT MPI_CXX_FOUND)
    list(APPEND npt_missing_packages libopenmpi-dev)
  endif()
endif()
if(NPT_BUILD_TESTS)
  npt_need(doctest doctest-dev)
endif()

if(npt_missing_packages)
  list(REMOVE_DUPLICATES npt_missing_packages)
  list(JOIN npt_missing_packages " " npt_missing_packages)
  message(FATAL_ERROR "npt: these packages are missing: ${npt_missing_packages}\n"
                      "On Debian and Ubuntu: sudo apt-get install ${npt_missing_packages}\n"
                      "or run ${CMAKE_CURRENT_LIST_DIR}/install-dependencies.sh, which installs what is missing.")
endif()
