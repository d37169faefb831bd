# SPDX-License-Identifier: MIT
# Functions for tests that run libclothstream on another platform: Windows by Wine, Linux arm64 by QEMU. Source this file.
# `cmake` and `sources` must be set: the program and the root of the project.

skip() { echo "skipped: $*" && exit 77; }
fail() { echo "$*" && exit 1; }
need() { # command package
  command -v "$1" >/dev/null || skip "$1 is missing; install $2 (./dev test --long does)"
}

# needPlatform windows-x64|linux-arm64: sets `platform`, `compiler` and, if it must be compiled, `zstd`, its source. Skips
# the test without what the platform needs.
needPlatform() {
  platform=$1
  case "$platform" in
    windows-x64)
      need x86_64-w64-mingw32-g++-posix g++-mingw-w64-x86-64-posix
      wine=$(command -v wine64 || echo /usr/lib/wine/wine64)
      need "$wine" wine64
      zstd=$sources/build/zstd
      [ -d "$zstd" ] || skip "build/zstd, the source of zstd, is missing (./dev test --long loads it)"
      compiler=x86_64-w64-mingw32-gcc-posix
      ;;
    linux-arm64)
      need aarch64-linux-gnu-g++ g++-aarch64-linux-gnu
      need qemu-aarch64 qemu-user
      { [ -e /usr/lib/aarch64-linux-gnu/libssl.so ] && [ -e /usr/lib/aarch64-linux-gnu/libzstd.so ]; } ||
        skip "OpenSSL or zstd for arm64 is missing; dpkg --add-architecture arm64, and install libssl-dev:arm64 and libzstd-dev:arm64 (./dev test --long does)"
      compiler=aarch64-linux-gnu-gcc
      ;;
    *) fail "no such platform: $platform" ;;
  esac
}

# buildLibrary BUILD PREFIX: builds libclothstream for the platform and installs it. Sets `library`, the file to link.
buildLibrary() {
  local build=$1 prefix=$2 log=$2.log
  "$cmake" -S "$sources" -B "$build" -G Ninja -DCMAKE_TOOLCHAIN_FILE="$sources/cmake/toolchains/$platform.cmake" \
    -DCLOTHSTREAM_CLIENT_ONLY=ON -DCMAKE_BUILD_TYPE=Release -DCMAKE_UNITY_BUILD=ON -DCMAKE_CXX_FLAGS=-Werror \
    ${zstd:+"-DCLOTHSTREAM_ZSTD_SOURCE=$zstd"} \
    >"$log" || fail "$(cat "$log")"
  "$cmake" --build "$build" --target clothstream_library -- -j2 >"$log" || fail "$(cat "$log")"
  "$cmake" --install "$build" --prefix "$prefix" >/dev/null
  library=$(find "$prefix" -name 'libclothstream.so' -o -name 'clothstream.dll.a')
}

# compileProgram SOURCE PREFIX OUT: compiles a program in C against the installed library. OUT ends in .exe. A DLL lies
# next to it then.
compileProgram() {
  "$compiler" -std=c11 -O2 -Wall -Wextra -Wpedantic -Werror -I"$2/include" "$1" "$library" -o "$3"
  [ "$platform" != windows-x64 ] || cp "$2/bin/clothstream.dll" "${3%/*}/"
}

# startWine PREFIX: makes a directory for Wine, which must not exist, and starts its server there.
startWine() {
  export WINEPREFIX=$1 WINEDEBUG=-all WINEDLLOVERRIDES=mscoree,mshtml=
  unset DISPLAY
  mkdir "$WINEPREFIX"
  /usr/lib/wine/wineserver64 -p # stays between the programs
  "$wine" wineboot -i >/dev/null 2>&1
}

# Ends the processes of this WINEPREFIX only.
stopWine() {
  [ ! -d "${WINEPREFIX:-/nowhere}" ] || /usr/lib/wine/wineserver64 -k 2>/dev/null || true
}

# there PROGRAM ARGUMENT...: runs a program of the platform.
there() {
  case "$platform" in
    windows-x64) "$wine" "$@" | tr -d '\r' ;;
    linux-arm64) qemu-aarch64 -L / -E LD_LIBRARY_PATH="${library%/*}" "$@" ;;
  esac
}
