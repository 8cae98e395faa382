# cmake -DDUMP=dump_gltf -DNODE=node -DFILES=LIST -DFOLDER=FOLDER -P validate.cmake: writes GLB files of every kind, and FILES again, and
# runs Khronos' validator on them.
file(REMOVE_RECURSE "${FOLDER}")
file(MAKE_DIRECTORY "${FOLDER}/made")
execute_process(COMMAND "${DUMP}" --made "${FOLDER}/made" COMMAND_ERROR_IS_FATAL ANY)
foreach(file IN LISTS FILES)
  cmake_path(GET file STEM name)
  file(MAKE_DIRECTORY "${FOLDER}/${name}")
  execute_process(COMMAND "${DUMP}" "${file}" "${FOLDER}/${name}" COMMAND_ERROR_IS_FATAL ANY)
endforeach()
file(GLOB written "${FOLDER}/*/*.glb")
execute_process(COMMAND "${NODE}" "${CMAKE_CURRENT_LIST_DIR}/validate.js" ${written} COMMAND_ERROR_IS_FATAL ANY)
