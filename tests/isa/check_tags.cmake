# cmake -DCOMPILER=PROGRAM -DINCLUDE=FOLDER -P check_tags.cmake
# Flags that give other code give other names: no two of them share the inline namespace, and each has the one expected.
set(cases
    "-march=x86-64|v0_sse2" "-msse3|v0_sse3" "-mssse3|v0_ssse3" "-msse4.1|v0_sse4" "-msse4.2|v0_sse42" "-mavx|v0_avx"
    "-mavx -mfma|v0_avxfma" "-mavx2|v0_avx2" "-march=haswell|v0_avx2fma" "-mavx512f|v0_avx512f"
    "-mavx512f -mavx512dq|v0_avx512f_dq" "-mavx512f -mavx512bw|v0_avx512f_bw"
    "-mavx512bw -mavx512bf16|v0_avx512f_bw_bf16" "-march=skylake-avx512|v0_avx512" "-march=cooperlake|v0_avx512bf16"
    "-march=sapphirerapids|v0_avx512amx")
foreach(case IN LISTS cases)
  string(REPLACE "|" ";" case "${case}")
  list(GET case 0 flags)
  list(GET case 1 expected)
  separate_arguments(flag_list UNIX_COMMAND "${flags}")
  execute_process(COMMAND "${COMPILER}" -std=c++20 -E -P ${flag_list} "-I${INCLUDE}" "${CMAKE_CURRENT_LIST_DIR}/tag.cpp"
                  OUTPUT_VARIABLE text RESULT_VARIABLE result ERROR_VARIABLE errors)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${COMPILER} ${flags}: ${errors}")
  endif()
  if(NOT text MATCHES "tag_of_this_unit : ([a-z0-9_]+)")
    message(FATAL_ERROR "${flags}: no tag in the preprocessed text")
  endif()
  if(NOT CMAKE_MATCH_1 STREQUAL expected)
    message(SEND_ERROR "${flags}: ${CMAKE_MATCH_1} instead of ${expected}")
  endif()
endforeach()
