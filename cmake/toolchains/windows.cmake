# Windows with Debian's mingw-w64; run by wine. cmake/platform-packages.sh windows brings both, and the libraries that npt
# needs into NPT_PLATFORM_ROOT. Programs hold all of it and run alone.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)
set(NPT_PLATFORM_ROOT "${CMAKE_CURRENT_LIST_DIR}/../../build/platforms/windows" CACHE PATH "Libraries of the platform")
cmake_path(ABSOLUTE_PATH NPT_PLATFORM_ROOT NORMALIZE)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES NPT_PLATFORM_ROOT)
set(CMAKE_LIBRARY_ARCHITECTURE x86_64-linux-gnu)  # where Debian keeps the packages of libraries that are headers only
set(CMAKE_FIND_ROOT_PATH "${NPT_PLATFORM_ROOT}" /usr/x86_64-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
# Large units have more sections than the old format of objects counts.
set(CMAKE_CXX_FLAGS_INIT "-Wa,-mbig-obj")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "-static")
set(CMAKE_CROSSCOMPILING_EMULATOR env WINEDEBUG=-all "WINEPREFIX=${NPT_PLATFORM_ROOT}/wine" /usr/lib/wine/wine64)
