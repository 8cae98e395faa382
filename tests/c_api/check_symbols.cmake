# The library shows the functions of npt_c.h and nothing else.
cmake_minimum_required(VERSION 3.25)
if(LIBRARY MATCHES "\\.dll$")
  execute_process(COMMAND "${OBJDUMP}" -p "${LIBRARY}" OUTPUT_VARIABLE output COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX REPLACE ".*\\[Ordinal/Name Pointer\\] Table[^\n]*\n" "" output "${output}")
  string(REGEX REPLACE "\n[^\t\n].*" "" output "${output}\n")
  string(REPLACE "]" ":" output "${output}")  # lists count brackets
  string(REPLACE "[" "" output "${output}")
  string(REGEX MATCHALL "[0-9]+: [^\n]+" symbols "${output}")
  list(TRANSFORM symbols REPLACE ".*: " "")
else()
  execute_process(COMMAND "${NM}" --dynamic --defined-only --format=posix "${LIBRARY}" OUTPUT_VARIABLE output
                  COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCHALL "[^\n ]+ [^\n]*\n" symbols "${output}")
  list(TRANSFORM symbols REPLACE " .*\n" "")
endif()
list(SORT symbols)
set(expected npt_close npt_close_sequence npt_close_skeleton npt_default_options npt_describe npt_explain npt_explain_frame
             npt_last_error npt_last_notes npt_move_frame_joints npt_move_joints npt_open npt_open_random npt_open_sequence
             npt_open_skeleton npt_prepare npt_prepare_identity npt_prepare_pose npt_release_identity npt_release_pose npt_run
             npt_run_frame npt_run_prepared npt_version)
if(NOT symbols STREQUAL expected)
  message(FATAL_ERROR "found ${symbols}\nexpected ${expected}")
endif()
