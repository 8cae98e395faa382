# ARM64 Linux with Debian's cross compiler; run by qemu-user. cmake/platform-packages.sh arm64 brings both, and the
# libraries that npt needs into NPT_PLATFORM_ROOT.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
# g++ 12 takes an enumerator beyond the last for possible, and tells of ABIs that differ from those of g++ 9.
set(CMAKE_CXX_FLAGS_INIT "-Wno-psabi -Wno-array-bounds")
set(NPT_PLATFORM_ROOT "${CMAKE_CURRENT_LIST_DIR}/../../build/platforms/arm64" CACHE PATH "Libraries of the platform")
cmake_path(ABSOLUTE_PATH NPT_PLATFORM_ROOT NORMALIZE)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES NPT_PLATFORM_ROOT)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH "${NPT_PLATFORM_ROOT}" /usr/aarch64-linux-gnu)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(npt_platform_libraries "${NPT_PLATFORM_ROOT}/usr/lib/aarch64-linux-gnu")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,-rpath-link,${npt_platform_libraries}")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "-Wl,-rpath-link,${npt_platform_libraries}")
set(CMAKE_CROSSCOMPILING_EMULATOR
    env QEMU_LD_PREFIX=/usr/aarch64-linux-gnu "QEMU_SET_ENV=LD_LIBRARY_PATH=${npt_platform_libraries}" qemu-aarch64)
