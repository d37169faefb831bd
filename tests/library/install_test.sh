#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Installs the build to a temporary prefix, then builds and runs a program against it with find_package and pkg-config. Usage: install_test.sh CMAKE BUILD_FOLDER VERSION
set -euo pipefail
cmake=$1 build=$2 version=$3
consumer=$(cd "$(dirname "${BASH_SOURCE[0]}")/consumer" && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$cmake" --install "$build" --prefix "$folder/first" >/dev/null
# The installation works after a move.
mv "$folder/first" "$folder/prefix"
prefix=$folder/prefix
"$prefix/bin/clothstream" --version
"$prefix/bin/clothstream-server" --version

expect() { # what-it-is program...
  local said
  said=$("${@:2}")
  [ "$said" = "libclothstream $version" ] || { echo "$1 says '$said', not 'libclothstream $version'" && exit 1; }
  echo "$1: $said"
}

"$cmake" -S "$consumer" -B "$folder/build" -DCMAKE_PREFIX_PATH="$prefix" -DWANTED_VERSION="$version" >/dev/null
"$cmake" --build "$folder/build" >/dev/null
expect find_package "$folder/build/consumer"

pc=$(find "$prefix" -name clothstream.pc -printf '%h')
export PKG_CONFIG_PATH=$pc
read -ra flags <<<"$(pkg-config --cflags --libs "clothstream = $version")"
cc -std=c11 -Wall -Wextra -Wpedantic -Werror "$consumer/consumer.c" "${flags[@]}" -o "$folder/by_pkg_config"
LD_LIBRARY_PATH=$(pkg-config --variable=libdir clothstream) expect pkg-config "$folder/by_pkg_config"
