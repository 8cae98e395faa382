# Builds and runs one consumer project, from nothing, in a folder of its own.
# usage: cmake -DNAME=folder -DSOURCE=npt -DWORK=folder -DCOMPILER=c++ [-DLAUNCHER=ccache] -DGENERATOR=name -P consume.cmake
cmake_minimum_required(VERSION 3.25)
set(consumer "${CMAKE_CURRENT_LIST_DIR}/${NAME}")
set(build "${WORK}/${NAME}")
file(REMOVE_RECURSE "${build}")
file(MAKE_DIRECTORY "${build}")

function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

# -O0 throughout: in a release build npt::compiled asks for -O2 in some units.
set(build_type Release)
if(NAME MATCHES "^compiled")
  set(build_type Debug)
endif()
set(configure "${CMAKE_COMMAND}" -G "${GENERATOR}" -DCMAKE_CXX_COMPILER=${COMPILER} "-DCMAKE_CXX_COMPILER_LAUNCHER=${LAUNCHER}"
              -DCMAKE_BUILD_TYPE=${build_type} -DCMAKE_CXX_FLAGS_RELEASE=-O0 -DCMAKE_CXX_FLAGS_DEBUG=-O0)

# pkg_config and components run behind find_package, on what that installed.
set(prefix "${build}/prefix")
if(NAME STREQUAL "components")
  set(prefix "${WORK}/find_package/prefix")
endif()
if(NAME MATCHES "^(find_package|no_tbb)$")
  run(${configure} -S "${SOURCE}" -B "${build}/npt" -DNPT_BUILD_PROGRAMS=OFF -DNPT_BUILD_TESTS=OFF)
  run("${CMAKE_COMMAND}" --install "${build}/npt" --prefix "${build}/prefix")
endif()

if(NAME STREQUAL "compiled_installed")
  run(${configure} -S "${SOURCE}" -B "${build}/npt" -DNPT_BUILD_PROGRAMS=OFF -DNPT_BUILD_TESTS=OFF -DNPT_NATIVE=OFF
      -DNPT_INSTALL_COMPILED=ON)
  run("${CMAKE_COMMAND}" --build "${build}/npt")
  run("${CMAKE_COMMAND}" --install "${build}/npt" --prefix "${build}/prefix")
endif()

if(NAME STREQUAL "pkg_config")
  find_program(PKG_CONFIG pkg-config)
  if(NOT PKG_CONFIG)
    message("SKIPPED: pkg-config is not installed")
    return()
  endif()
  set(ENV{PKG_CONFIG_PATH} "${WORK}/find_package/prefix/share/pkgconfig:$ENV{PKG_CONFIG_PATH}")
  run("${consumer}/build.sh" "${COMPILER}" "${CMAKE_CURRENT_LIST_DIR}/main.cpp" "${build}/consumer")
else()
  run(${configure} -S "${consumer}" -B "${build}" "-DNPT_SOURCE_DIR=${SOURCE}" "-DCMAKE_PREFIX_PATH=${prefix}")
  run("${CMAKE_COMMAND}" --build "${build}")
endif()
run("${build}/consumer")
message("${output}")
if(NAME STREQUAL "compiled_installed")
  execute_process(COMMAND "${CMAKE_COMMAND}" --build "${build}" --target other_flags
                  RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(status EQUAL 0 OR NOT output MATCHES "unit for v[0-9a-z_]+, npt::compiled for v[0-9a-z_]+: give both the same -march")
    message(FATAL_ERROR "Flags of another instruction set should be refused in words:\n${output}")
  endif()
endif()
