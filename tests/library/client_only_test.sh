#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds the library alone, on a machine that seems to have neither Vulkan, gRPC nor protobuf; installs it; builds
# examples/c against it, and runs that with a server. Usage: client_only_test.sh CMAKE SOURCES SERVER
set -euo pipefail
cmake=$1 sources=$2 server=$3
folder=$(mktemp -d)
pid=
trap '[ -z "$pid" ] || kill "$pid" 2>/dev/null; rm -rf "$folder"' EXIT

hidden=()
for package in Vulkan gRPC Protobuf fmt spdlog draco nlohmann_json CLI11 prometheus-cpp SQLite3 GTest ZLIB; do
  hidden+=("-DCMAKE_DISABLE_FIND_PACKAGE_$package=ON")
done
"$cmake" -S "$sources" -B "$folder/build" -G Ninja -DCLOTHSTREAM_CLIENT_ONLY=ON -DCMAKE_BUILD_TYPE=Debug \
  -DCMAKE_CXX_FLAGS_DEBUG=-O0 -DCMAKE_UNITY_BUILD=ON --no-warn-unused-cli "${hidden[@]}" >/dev/null
"$cmake" --build "$folder/build" --target clothstream_library -- -j2 >/dev/null
"$cmake" --install "$folder/build" --prefix "$folder/prefix" >/dev/null

"$cmake" -S "$sources/examples/c" -B "$folder/example" -DCMAKE_PREFIX_PATH="$folder/prefix" >/dev/null
"$cmake" --build "$folder/example" >/dev/null

"$server" --port 0 --grpc-port 0 --scene small --scene-file "$sources/tests/e2e/small.json" >"$folder/server" 2>&1 &
pid=$!
for _ in $(seq 600); do
  address=$(sed -n 's/^page *\(http:[^ ]*\).*/\1/p' "$folder/server")
  [ -n "$address" ] && break
  if ! kill -0 "$pid" 2>/dev/null; then
    cat "$folder/server"
    grep -q 'no Vulkan' "$folder/server" && exit 77 # skipped: the server needs a device
    exit 1
  fi
  sleep 0.1
done
said=$("$folder/example/follow" "$address")
[[ $said == *"320 vertices, the first at -0.80 "* ]] || { echo "the example says: $said" && exit 1; }

lines=$(grep -cvE '^ *(/\*.*|\*.*|//.*)?$' "$sources/examples/c/follow.c")
[ "$lines" -le 40 ] || { echo "examples/c/follow.c has $lines lines of code; at most 40 are promised" && exit 1; }
