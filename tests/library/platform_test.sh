#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds libclothstream for another platform, follows a scene there and here at the same time, and compares the bits of
# each frame: without TLS, with TLS and a fingerprint, and with TLS and an authority. Refused servers are reported. Frames of
# a recording are compared as well.
# Usage: platform_test.sh windows-x64|linux-arm64 CMAKE SOURCES BUILD SERVER HASHES
# BUILD: folder of the build, which is used again. HASHES: hashes.c for this machine.
set -euo pipefail
platform=$1 cmake=$2 sources=$3 build=$4 server=$5 here=$6
readonly FRAMES=60

. "$(dirname "${BASH_SOURCE[0]}")/platform.sh"
needPlatform "$platform"

folder=$(mktemp -d)
server_pid=
stopServer() {
  [ -z "$server_pid" ] || kill "$server_pid" 2>/dev/null || true
  [ -z "$server_pid" ] || wait "$server_pid" 2>/dev/null || true
  server_pid=
}
here_pid=
stopHere() {
  [ -z "$here_pid" ] || kill "$here_pid" 2>/dev/null || true
  [ -z "$here_pid" ] || wait "$here_pid" 2>/dev/null || true
  here_pid=
}
cleanUp() {
  stopHere
  stopServer
  stopWine
  rm -rf "$folder"
}
trap cleanUp EXIT

prefix=$folder/prefix
buildLibrary "$build" "$prefix"
compileProgram "$sources/tests/library/hashes.c" "$prefix" "$folder/hashes.exe"

if [ "$platform" = windows-x64 ]; then
  "$cmake" -S "$sources/examples/c" -B "$folder/example" -G Ninja -DCMAKE_PREFIX_PATH="$prefix" \
    -DCMAKE_TOOLCHAIN_FILE="$sources/cmake/toolchains/$platform.cmake" >/dev/null
  "$cmake" --build "$folder/example" >/dev/null
  needs=$(x86_64-w64-mingw32-objdump -p "$folder/clothstream.dll" | sed -n 's/.*DLL Name: //p' | tr 'A-Z' 'a-z' | LC_ALL=C sort | tr '\n' ' ')
  [ "$needs" = "crypt32.dll kernel32.dll msvcrt.dll mswsock.dll winhttp.dll ws2_32.dll " ] ||
    fail "clothstream.dll must need only libraries of Windows, but it needs $needs"
  startWine "$folder/wine"
fi

# serve OPTION...: starts a server on a free port. Sets `address` (HOST:PORT) and `fingerprint`.
serve() {
  stopServer
  "$server" --port 0 --grpc-port 0 --scene small --scene-file "$sources/tests/e2e/small.json" \
    --state-dir "$folder/state" "$@" >"$folder/server" 2>&1 &
  server_pid=$!
  for _ in $(seq 600); do
    address=$(sed -nE 's/^page *https?:\/\/([^/]*)\/$/\1/p' "$folder/server")
    [ -n "$address" ] && break
    if ! kill -0 "$server_pid" 2>/dev/null; then
      grep -q 'no Vulkan' "$folder/server" && skip "the server needs a Vulkan device"
      fail "$(cat "$folder/server")"
    fi
    sleep 0.1
  done
  fingerprint=$(sed -n 's/^key *//p' "$folder/server")
}

# waitFor FAILURE COMMAND...: waits until the command succeeds.
waitFor() {
  local failure=$1
  shift
  for _ in $(seq 600); do
    "$@" && return
    sleep 0.1
  done
  fail "$failure"
}

# compare WHAT ADDRESS OPTION...: both must have the same bits for the ticks that both have. The program of this machine
# runs from before the other one starts until it has the other one's last tick.
compare() {
  local what=$1 same common last
  shift
  "$here" "$1" 100000 "${@:2}" >"$folder/here" &
  here_pid=$!
  waitFor "$what: the program of this machine has no frame" grep -q frame "$folder/here"
  there "$folder/hashes.exe" "$1" "$FRAMES" "${@:2}" >"$folder/there" || fail "$what: $platform failed"
  last=$(tail -n 1 "$folder/there" | cut -d ' ' -f 2)
  waitFor "$what: the program of this machine has ended" awk -v last="$last" '$2 >= last { found = 1 } END { exit !found }' "$folder/here"
  stopHere
  for side in here there; do grep -E '^frame [0-9]+ [0-9a-f]{16}$' "$folder/$side" | sort >"$folder/$side.sorted"; done
  same=$(comm -12 "$folder/here.sorted" "$folder/there.sorted" | wc -l)
  common=$(join -j 2 <(sort -k 2,2 "$folder/here.sorted") <(sort -k 2,2 "$folder/there.sorted") | wc -l)
  echo "$what: $same of $common common frames have the same bits"
  [ "$same" -eq "$common" ] && [ "$common" -ge 20 ] || fail "$what: frames differ, or too few are common"
}

# refuse WHAT TEXT ADDRESS OPTION...: the program must fail and say TEXT.
refuse() {
  local what=$1 text=$2 said status=0
  shift 2
  said=$(there "$folder/hashes.exe" "$1" 1 "${@:2}" 2>&1) || status=$?
  [ "$status" -ne 0 ] || fail "$what: was accepted"
  [[ $said == *"$text"* ]] || fail "$what: '$text' is not in: $said"
  echo "$what: $said"
}

# Recordings that the server has made, in the chunks of a file: each frame has the bits of this machine.
sample=$sources/examples/testing/cloth.mcap
for side in here there; do
  if [ "$side" = here ]; then "$here" recording "$sample"; else there "$folder/hashes.exe" recording "$sample"; fi >"$folder/$side"
done
frames=$(grep -cE '^frame [0-9]+ [0-9a-f]{16}$' "$folder/here")
[ "$frames" -ge 20 ] && cmp "$folder/here" "$folder/there" || fail "the recording has other frames on $platform"
echo "recording: $frames frames have the same bits"

serve
compare "without TLS" "ws://$address"
if [ "$platform" = windows-x64 ]; then
  cp "$folder/clothstream.dll" "$folder/example/"
  said=$(there "$folder/example/follow.exe" "$address")
  [[ $said == *"320 vertices, the first at "* ]] || fail "the example says: $said"
fi
refuse "TLS that the server does not have" "does not answer with TLS" "wss://$address"

mkdir "$folder/keys"
"$server" token --new-key "$folder/keys/key.pem" >/dev/null
token=$("$server" token --key "$folder/keys/key.pem" --role participant --name Ada --subject ada)
serve --tls self --token-keys "$folder/keys"
authority=$folder/state/tls/self.pem
compare "fingerprint and token" "wss://$address" fingerprint "$fingerprint" token "$token"
compare "authority and token" "wss://$address" ca "$authority" token "$token"
wrong=$(tr '0-9A-F' '1-9A-F0' <<<"$fingerprint")
refuse "wrong fingerprint" "it has the fingerprint $fingerprint" "wss://$address" fingerprint "$wrong" token "$token"
refuse "unknown authority" "no known authority has signed its certificate" "wss://$address" token "$token"
openssl req -x509 -newkey rsa:2048 -nodes -keyout "$folder/other.key" -out "$folder/other.pem" -subj /CN=other 2>/dev/null
refuse "other authority" "no known authority has signed its certificate" "wss://$address" ca "$folder/other.pem" token "$token"
refuse "no token" "requires a token" "wss://$address" fingerprint "$fingerprint"

# The programs of the platform have left with a close frame, so that the server keeps no place for them.
stopServer
[ "$(grep -c ' left; ' "$folder/server")" -eq 2 ] || fail "a client that has left counts as lost: $(cat "$folder/server")"
