# clang 19 warns of its own flags for a processor with AVX10.1, which no other flag of ours can make right.
set(npt_native_flags -march=native)
if(NPT_NATIVE AND CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  include(CheckCXXCompilerFlag)
  check_cxx_compiler_flag(-Winvalid-feature-combination NPT_KNOWS_INVALID_FEATURES)
  if(NPT_KNOWS_INVALID_FEATURES)
    list(APPEND npt_native_flags -Wno-invalid-feature-combination)
  endif()
endif()

# npt_target_options(TARGET): warnings and instruction set of the project's own programs and tests. Never put on
# npt::npt: a consumer chooses their own. Headers of dependencies come from imported targets, which CMake passes with
# -isystem, so the warnings are about this project's code only.
function(npt_target_options target)
  target_link_libraries(${target} PRIVATE npt::npt npt::io npt::xtensor)
  if(NPT_WITH_TBB)
    target_link_libraries(${target} PRIVATE TBB::tbb)
  else()
    target_compile_definitions(${target} PRIVATE NPT_DEFAULT_THREADS)
  endif()
  if(TARGET npt::baseline)
    target_link_libraries(${target} PRIVATE npt::baseline)
  endif()
  npt_unit_options(${target})
  if(NPT_NATIVE)
    target_compile_options(${target} PRIVATE ${npt_native_flags})
  endif()
endfunction()

# npt_unit_options(TARGET): what of it says nothing of what the target links and runs on.
function(npt_unit_options target)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion
                         -Wdouble-promotion)
  target_link_libraries(${target} PRIVATE npt::reproducible)
  # g++ collects its garbage at 128 MB at first, and again and again: 5 to 7 % of the time.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE --param=ggc-min-heapsize=1500000)
  endif()
  if(NPT_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()

# npt_optimise(TARGET LEVEL): for units whose speed matters little. g++ 12 takes 3/4 of the time at -O2 that it takes at -O3, and less at
# -O1; there it inlines few of xsimd's functions, and warns of its own strings (GCC bug 105651). At both it warns of its own AVX-512
# intrinsics (105593).
function(npt_optimise target level)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O${level}>)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(${target} PRIVATE -Wno-maybe-uninitialized -Wno-uninitialized)
    if(level LESS 2)
      target_compile_options(${target} PRIVATE -Wno-array-bounds -Wno-stringop-overflow -Wno-restrict)
    endif()
    if(level EQUAL 0)
      target_compile_options(${target} PRIVATE -ffold-simple-inlines)  # std::move and the like as at -O1: a twentieth of the time
    endif()
  endif()
endfunction()
