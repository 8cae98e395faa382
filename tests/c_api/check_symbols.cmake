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
set(expected npt_animate_file npt_apply npt_character_estimate npt_character_joints npt_character_mesh npt_character_save
             npt_close npt_close_bytes npt_close_skeleton npt_close_tracker npt_default_motion_options npt_default_options
             npt_describe npt_describe_motion npt_frame_times npt_frames_to_try npt_last_error npt_last_error_code
             npt_last_notes npt_last_remedy npt_load_character npt_make_motion npt_measure npt_motion_bytes npt_motion_of_character
             npt_motion_roles npt_motion_warning_text npt_move_joints npt_next_pose npt_open npt_open_files npt_open_random
             npt_open_shipped npt_open_skeleton npt_open_tracker npt_pose_estimate npt_pose_joints npt_prepare npt_prepare_character
             npt_prepare_pose npt_read_motion npt_read_skeleton npt_reads_fbx npt_release_character npt_release_motion
             npt_release_pose npt_remedy_text npt_report npt_restart_tracker npt_role_name npt_run npt_sample_motion
             npt_start_tracker npt_transfer_motion npt_transfer_motion_file npt_version npt_warning_text npt_write_motion
             npt_write_motions)
if(NOT symbols STREQUAL expected)
  message(FATAL_ERROR "found ${symbols}\nexpected ${expected}")
endif()
