# Android 10 and later on 64-bit Arm, with the Android NDK of the environment variable ANDROID_NDK, and an OpenSSL for it:
#   cmake -G Ninja -B build/android -DCMAKE_TOOLCHAIN_FILE=cmake/toolchains/android-arm64.cmake -DCLOTHSTREAM_CLIENT_ONLY=ON \
#     -DOPENSSL_ROOT_DIR=FOLDER
# Never tried: docs/client-library.md.
if(NOT DEFINED ENV{ANDROID_NDK})
  message(FATAL_ERROR "ANDROID_NDK is not set; set it to the folder of the Android NDK")
endif()
set(ANDROID_ABI arm64-v8a)
set(ANDROID_PLATFORM android-29)
set(ANDROID_STL c++_static)
include($ENV{ANDROID_NDK}/build/cmake/android.toolchain.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/header_only.cmake)
list(APPEND CMAKE_FIND_ROOT_PATH ${OPENSSL_ROOT_DIR})
