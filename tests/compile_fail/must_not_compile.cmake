# cmake -DCOMPILER=PROGRAM -DFLAGS="FLAG ..." -DSOURCE=FILE -P must_not_compile.cmake
# Fails unless the compiler refuses SOURCE with exactly one error and says every text of its `// expect:` comments.

# FATAL_ERROR alone would re-wrap the compiler's output.
function(fail complaint)
  message("${SOURCE}: ${complaint}")
  message(FATAL_ERROR "Failed.")
endfunction()

file(STRINGS "${SOURCE}" expectations REGEX "^// expect: ")
if(NOT expectations)
  fail("no line '// expect: TEXT'")
endif()

# A case may ask for flags of its own: `// flags: FLAG ...`.
file(STRINGS "${SOURCE}" own_flags REGEX "^// flags: ")
string(REGEX REPLACE "// flags: " "" own_flags "${own_flags}")
separate_arguments(flags UNIX_COMMAND "${FLAGS} ${own_flags}")
# Without column limits or colours, and in English, whatever the user's settings are.
set(ENV{LC_ALL} C)
execute_process(COMMAND "${COMPILER}" ${flags} "${SOURCE}" RESULT_VARIABLE result
                OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(result EQUAL 0)
  fail("compiles, and must not")
endif()

string(REGEX MATCHALL "error:" errors "${output}")
list(LENGTH errors count)
if(NOT count EQUAL 1)
  fail("${count} errors instead of one:\n${output}")
endif()
foreach(expectation IN LISTS expectations)
  string(REGEX REPLACE "^// expect: " "" expectation "${expectation}")
  string(FIND "${output}" "${expectation}" position)
  if(position EQUAL -1)
    fail("the compiler does not say '${expectation}':\n${output}")
  endif()
endforeach()
