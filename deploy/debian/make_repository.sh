#!/usr/bin/env bash
# Packs a finished build as Debian packages, and makes the APT repository APT with them, for the release of Debian that
# built them. The codename is in APT/conf/distributions.
# Usage: make_repository.sh BUILD APT
set -euo pipefail
build=$(realpath "$1") apt=$2
exec 9>"$build/.lock" # as ./dev does: one build in a folder at a time
flock 9

cmake --build "$build" --target clothstream_manuals >/dev/null
rm -rf "$build/debian" "$apt"
(cd "$build" && cpack >debian.log) || { cat "$build/debian.log" && exit 1; }
mkdir -p "$apt/conf"
cp "$build/deploy/distributions" "$apt/conf/"
release=$(sed -n 's/^Codename: //p' "$apt/conf/distributions")
reprepro --silent --basedir "$apt" includedeb "$release" "$build"/debian/*.deb
