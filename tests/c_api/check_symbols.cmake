# The library shows the functions of npt_c.h and nothing else.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND "${NM}" --dynamic --defined-only --format=posix "${LIBRARY}" OUTPUT_VARIABLE output
                COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^\n ]+ [^\n]*\n" symbols "${output}")
list(TRANSFORM symbols REPLACE " .*\n" "")
list(SORT symbols)
set(expected npt_close npt_describe npt_last_error npt_open_random npt_open_weights npt_transfer npt_version)
if(NOT symbols STREQUAL expected)
  message(FATAL_ERROR "found ${symbols}\nexpected ${expected}")
endif()
