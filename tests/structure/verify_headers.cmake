# cmake -DBUILD=FOLDER -P verify_headers.cmake: configures, since a header may include others than it
# did, and compiles each folder of headers alone.
foreach(arguments IN ITEMS "${BUILD}" "--build;${BUILD};--target;npt_verify_headers;--parallel;2")
  execute_process(COMMAND "${CMAKE_COMMAND}" ${arguments} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message("${output}")
    message(FATAL_ERROR "Failed.")
  endif()
endforeach()
