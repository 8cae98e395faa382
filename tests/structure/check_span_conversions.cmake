# cmake -DCOMPILER=PROGRAM -DINCLUDE=FOLDER -DFOLDER=FOLDER -P check_span_conversions.cmake: the umbrella's headers convert no container to
# std::span by its constructor for ranges, whose concepts cost g++ 12 72 million instructions for each type of elements (as_span() costs
# none). They are parsed with a copy of libstdc++'s <span> whose constructor takes nothing.
cmake_minimum_required(VERSION 3.25)
file(WRITE "${FOLDER}/include_span.cpp" "#include <span>\n")
execute_process(COMMAND "${COMPILER}" -std=c++20 -E "${FOLDER}/include_span.cpp" OUTPUT_VARIABLE expanded COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCH "\"(/[^\"\n]*/span)\"" match "${expanded}")
set(text "")
if(match)
  file(READ "${CMAKE_MATCH_1}" text)
endif()
set(constraint "&& ranges::contiguous_range<_Range>")
string(REPLACE "${constraint}" "&& false ${constraint}" without "${text}")
if(without STREQUAL text)
  message("SKIPPED: this standard library isn't a libstdc++ whose <span> is known")
  return()
endif()
file(WRITE "${FOLDER}/without/span" "${without}")
file(WRITE "${FOLDER}/umbrella.cpp" "#include <npt/npt.hpp>\n")
execute_process(COMMAND "${COMPILER}" -std=c++20 -fsyntax-only -fmax-errors=3 "-I${FOLDER}/without" "-I${INCLUDE}" "${FOLDER}/umbrella.cpp"
                ERROR_VARIABLE errors RESULT_VARIABLE status)
if(NOT status EQUAL 0)
  message(FATAL_ERROR "convert by as_span() of npt/base/as_span.hpp, where the compiler finds no conversion:\n${errors}")
endif()
