# clang 19 with LLVM's standard library, as on macOS, WebAssembly and Android. cmake/platform-packages.sh libcxx brings both.
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
set(NPT_PLATFORM_ROOT "${CMAKE_CURRENT_LIST_DIR}/../../build/platforms/libcxx" CACHE PATH "Libraries of the platform")
cmake_path(ABSOLUTE_PATH NPT_PLATFORM_ROOT NORMALIZE)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES NPT_PLATFORM_ROOT)
list(PREPEND CMAKE_PREFIX_PATH "${NPT_PLATFORM_ROOT}/usr")
set(CMAKE_CXX_FLAGS_INIT "-nostdinc++ -isystem ${NPT_PLATFORM_ROOT}/usr/lib/llvm-19/include/c++/v1")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostdlib++ -L${NPT_PLATFORM_ROOT}/usr/lib/llvm-19/lib")
set(CMAKE_CXX_STANDARD_LIBRARIES_INIT "-l:libc++.a -l:libc++abi.a -pthread")  # behind all that asks for them
set(CMAKE_SHARED_LINKER_FLAGS_INIT "${CMAKE_EXE_LINKER_FLAGS_INIT}")
# Debian's are for the other standard library.
set(CMAKE_DISABLE_FIND_PACKAGE_assimp ON)
set(CMAKE_DISABLE_FIND_PACKAGE_draco ON)
