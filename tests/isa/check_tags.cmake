# cmake -DCOMPILER=PROGRAM -DINCLUDE=FOLDER -P check_tags.cmake
# Flags that give other code give other names: no two of them share the inline namespace, and each has the one expected.
cmake_minimum_required(VERSION 3.25)

# The inline namespace of a unit that is compiled with these flags, and whether it would run on oneTBB.
function(tag_of result tbb)
  execute_process(COMMAND "${COMPILER}" -std=c++20 -E -P ${ARGN} "-I${INCLUDE}" "${CMAKE_CURRENT_LIST_DIR}/tag.cpp"
                  OUTPUT_VARIABLE text RESULT_VARIABLE status ERROR_VARIABLE errors)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "${COMPILER} ${ARGN}: ${errors}")
  endif()
  if(NOT text MATCHES "tag_of_this_unit : ([a-z0-9_]+)")
    message(FATAL_ERROR "${ARGN}: no tag in the preprocessed text")
  endif()
  set(${result} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  if(NOT text MATCHES "tbb_in_this_unit : ([01])")
    message(FATAL_ERROR "${ARGN}: no executor in the preprocessed text")
  endif()
  set(${tbb} "${CMAKE_MATCH_1}" PARENT_SCOPE)
endfunction()

set(cases
    "-march=x86-64|sse2" "-msse3|sse3" "-mssse3|ssse3" "-msse4.1|sse4" "-msse4.2|sse42" "-mavx|avx" "-mavx -mfma|avxfma" "-mavx2|avx2"
    "-march=haswell|avx2fma" "-mavx512f|avx512f" "-mavx512f -mavx512dq|avx512f_dq" "-mavx512f -mavx512bw|avx512f_bw"
    "-mavx512bw -mavx512bf16|avx512f_bw_bf16" "-march=skylake-avx512|avx512" "-march=cooperlake|avx512bf16"
    "-march=sapphirerapids|avx512amx"
    "-march=haswell -DNPT_NO_TBB|serial_avx2fma" "-march=haswell -DNPT_NO_TBB -DNPT_DEFAULT_THREADS|threads_avx2fma"
    "-march=haswell -DNPT_PORTABLE_SIMD|portable_avx2fma" "-march=haswell -DNPT_PORTABLE_SIMD -DNPT_NO_TBB|portable_serial_avx2fma"
    "-march=haswell -DNPT_PORTABLE_SIMD -DNPT_NO_TBB -DNPT_DEFAULT_THREADS|portable_threads_avx2fma"
    "-march=sapphirerapids -DNPT_PORTABLE_SIMD -DNPT_NO_TBB|portable_serial_avx512bf16")
set(tags "")
foreach(case IN LISTS cases)
  string(REPLACE "|" ";" case "${case}")
  list(GET case 0 flags)
  list(GET case 1 expected)
  separate_arguments(flag_list UNIX_COMMAND "${flags}")
  tag_of(tag tbb ${flag_list})
  if(NOT tbb AND NOT flags MATCHES "NPT_NO_TBB")  # its headers are missing: as with NPT_NO_TBB
    string(REGEX REPLACE "^(portable_)?" "\\1serial_" expected "${expected}")
    message("${flags}: without the headers of oneTBB")
  elseif(tag IN_LIST tags)
    message(SEND_ERROR "${flags}: ${tag}, as other flags")
  endif()
  list(APPEND tags "${tag}")
  if(NOT tag MATCHES "^v[0-9]+_${expected}$")
    message(SEND_ERROR "${flags}: ${tag} instead of v1_${expected}")
  endif()
endforeach()

# Where there is oneTBB, threads of npt's own are not asked for.
tag_of(plain tbb -march=haswell)
tag_of(threads tbb -march=haswell -DNPT_DEFAULT_THREADS)
if(tbb AND NOT plain STREQUAL threads)
  message(SEND_ERROR "NPT_DEFAULT_THREADS beside oneTBB: ${threads} instead of ${plain}")
endif()
