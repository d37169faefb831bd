# Windows 10 and later, 64-bit, with Debian's g++-mingw-w64-x86-64-posix:
#   cmake -G Ninja -B build/windows -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/windows-x64.cmake -DCLOTHSTREAM_CLIENT_ONLY=ON
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)

set(CMAKE_FIND_ROOT_PATH /usr/x86_64-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH) # so that programs find an installed libclothstream in CMAKE_PREFIX_PATH
include(${CMAKE_CURRENT_LIST_DIR}/header_only.cmake)
# Debian has no zstd for Windows: without its source, recordings are left out.
if(NOT CLOTHSTREAM_ZSTD_SOURCE)
  set(CLOTHSTREAM_RECORDINGS OFF CACHE BOOL "libclothstream reads recordings")
endif()
