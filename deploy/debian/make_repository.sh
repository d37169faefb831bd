#!/usr/bin/env bash
# Packs a finished build as Debian packages, and makes the APT repository APT with them.
# Usage: make_repository.sh BUILD APT
set -euo pipefail
build=$(realpath "$1") apt=$2
here=$(dirname "$(realpath "$0")")

cmake --build "$build" --target clothstream_manuals >/dev/null
rm -rf "$build/debian" "$apt"
(cd "$build" && cpack >debian.log) || { cat "$build/debian.log" && exit 1; }
mkdir -p "$apt/conf"
cp "$here/distributions" "$apt/conf/"
reprepro --silent --basedir "$apt" includedeb bookworm "$build"/debian/*.deb
