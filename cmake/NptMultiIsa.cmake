# npt_add_multi_isa(TARGET SOURCES source... ENTRIES function... [ISAS isa...] [LIBRARIES library...])
#
# Compiles the sources once for each instruction set, puts all of it into TARGET, and lets the program pick at its
# start: a binary that runs on every x86-64 processor and uses AVX-512 where there is some.
#   ENTRIES    extern "C" functions that the sources define: the only way in from the rest of the program. A call of `f`
#              goes to the best of f__sse2, f__avx2, f__avx512, f__avx512bf16, which can be called by these names, too
#   ISAS       default: sse2 avx2 avx512 avx512bf16. The first must run on every machine that the program is for
#   LIBRARIES  what the sources need beside npt::npt
# Include folders and definitions of TARGET hold for the sources. Where there is no x86-64 with GNU tools and ifunc
# (glibc), they are compiled once, for the flags of TARGET, and the call is direct.
#
# Every other symbol of an instruction set's objects becomes local to them. npt's own names differ between instruction
# sets (inline namespace), but those of std::vector<float> and its like don't, and a linker keeps any one of their
# copies: without this, a processor without AVX-512 could meet AVX-512 code in code that all share.

# A function, since variables of this file are not seen where npt is a subproject.
function(npt_isa_flags result isa)
  set(sse2 "")
  set(avx2 -mavx2 -mfma)
  set(avx512 ${avx2} -mavx512f -mavx512cd -mavx512bw -mavx512dq -mavx512vl)
  set(avx512bf16 ${avx512} -mavx512bf16 -mamx-tile -mamx-bf16)
  if(NOT isa MATCHES "^(sse2|avx2|avx512|avx512bf16)$")
    message(FATAL_ERROR "npt_add_multi_isa: '${isa}' is none of sse2, avx2, avx512, avx512bf16")
  endif()
  set(${result} "${${isa}}" PARENT_SCOPE)
endfunction()

# What the processor and the system must have: the features of the flags, and no others, since -march= is fixed to
# x86-64. Matrix registers (AMX) are left out: npt asks for them itself before it uses them.
function(npt_isa_condition result isa)
  npt_isa_flags(flags ${isa})
  set(terms "true")
  foreach(flag IN LISTS flags)
    string(REGEX REPLACE "^-m" "" feature "${flag}")
    if(NOT feature MATCHES "^amx-")
      list(APPEND terms "__builtin_cpu_supports(\"${feature}\")")
    endif()
  endforeach()
  list(JOIN terms " && " condition)
  set(${result} "${condition}" PARENT_SCOPE)
endfunction()

function(npt_isa_picker result)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "ENTRIES;ISAS")
  list(REVERSE arg_ISAS)
  set(text "// Written by npt_add_multi_isa. Types are left out: calls only pass through.\nextern \"C\" {\n")
  foreach(entry IN LISTS arg_ENTRIES)
    set(choice "")
    foreach(isa IN LISTS arg_ISAS)
      npt_isa_condition(condition ${isa})
      string(APPEND text "void ${entry}__${isa}();\n")
      string(APPEND choice "  if (${condition}) return ${entry}__${isa};\n")
    endforeach()
    list(GET arg_ISAS -1 first)
    # Runs while the program is being linked: before constructors, and before what sanitizers put into functions works. Hidden and not
    # static, whose name clang 14 mangles, so that ifunc does not find it.
    string(APPEND text "__attribute__((used, visibility(\"hidden\"), no_sanitize(\"address\", \"thread\", \"undefined\"))) void (*npt_resolve_${entry}())() {\n"
           "  __builtin_cpu_init();\n${choice}  return ${entry}__${first};\n}\n"
           "void ${entry}() __attribute__((ifunc(\"npt_resolve_${entry}\")));\n")
  endforeach()
  set(${result} "${text}}\n" PARENT_SCOPE)
endfunction()

function(npt_add_multi_isa target)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;ENTRIES;ISAS;LIBRARIES")
  if(NOT arg_SOURCES OR NOT arg_ENTRIES OR arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "usage: npt_add_multi_isa(TARGET SOURCES source... ENTRIES function... [ISAS isa...] [LIBRARIES library...])")
  endif()
  if(NOT arg_ISAS)
    set(arg_ISAS sse2 avx2 avx512 avx512bf16)
  endif()
  target_link_libraries(${target} PRIVATE npt::npt ${arg_LIBRARIES})

  if(NOT CMAKE_SYSTEM_NAME STREQUAL "Linux" OR NOT CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64)$" OR NOT CMAKE_OBJCOPY)
    target_sources(${target} PRIVATE ${arg_SOURCES})
    return()
  endif()
  # CMake may choose lld for clang, whose version 14 doesn't know --force-group-allocation.
  set(linker "${CMAKE_LINKER}")
  if(linker MATCHES "lld")
    find_program(NPT_GNU_LINKER NAMES ld.bfd REQUIRED)
    mark_as_advanced(NPT_GNU_LINKER)
    set(linker "${NPT_GNU_LINKER}")
  endif()

  # `all` compiles for the instruction sets only where it builds the target itself.
  get_target_property(excluded ${target} EXCLUDE_FROM_ALL)
  if(excluded)
    set(excluded EXCLUDE_FROM_ALL)
  else()
    set(excluded "")
  endif()
  foreach(isa IN LISTS arg_ISAS)
    npt_isa_flags(flags ${isa})
    set(objects ${target}_${isa})
    add_library(${objects} OBJECT ${excluded} ${arg_SOURCES})
    target_link_libraries(${objects} PRIVATE npt::npt ${arg_LIBRARIES})
    target_include_directories(${objects} PRIVATE "$<TARGET_PROPERTY:${target},INCLUDE_DIRECTORIES>")
    target_compile_definitions(${objects} PRIVATE "$<TARGET_PROPERTY:${target},COMPILE_DEFINITIONS>")
    # -march after the flags of the build, which may say native. Symbols are made local in machine code: no LTO.
    target_compile_options(${objects} PRIVATE -march=x86-64 ${flags} -fno-lto
                                              $<$<CXX_COMPILER_ID:GNU>:-fno-gnu-unique>)
    set_target_properties(${objects} PROPERTIES POSITION_INDEPENDENT_CODE ON INTERPROCEDURAL_OPTIMIZATION OFF)

    set(renames "")
    set(kept "")
    foreach(entry IN LISTS arg_ENTRIES)
      list(APPEND renames --redefine-sym ${entry}=${entry}__${isa})
      list(APPEND kept --keep-global-symbol=${entry}__${isa})
    endforeach()
    set(joined "${CMAKE_CURRENT_BINARY_DIR}/${objects}.joined.o")
    set(sealed "${CMAKE_CURRENT_BINARY_DIR}/${objects}.o")
    add_custom_command(OUTPUT "${sealed}"
      COMMAND "${linker}" -r --force-group-allocation -o "${joined}" "$<TARGET_OBJECTS:${objects}>"
      COMMAND "${CMAKE_OBJCOPY}" ${renames} "${joined}" "${joined}"
      COMMAND "${CMAKE_OBJCOPY}" ${kept} "${joined}" "${sealed}"
      DEPENDS ${objects} "$<TARGET_OBJECTS:${objects}>"
      COMMENT "${target} for ${isa}: every symbol but the entries becomes local"
      COMMAND_EXPAND_LISTS VERBATIM)
    set_source_files_properties("${sealed}" PROPERTIES EXTERNAL_OBJECT ON GENERATED ON)
    target_sources(${target} PRIVATE "${sealed}")
  endforeach()

  npt_isa_picker(picker ENTRIES ${arg_ENTRIES} ISAS ${arg_ISAS})
  file(CONFIGURE OUTPUT "${CMAKE_CURRENT_BINARY_DIR}/${target}_picker.cpp" CONTENT "${picker}" @ONLY)
  target_sources(${target} PRIVATE "${CMAKE_CURRENT_BINARY_DIR}/${target}_picker.cpp")
endfunction()
