#!/usr/bin/env bash
# Makes the folder KIT from a finished build: programs that test and measure a GPU, the libraries that they need, and the
# committed figures. A machine with a Vulkan driver, sh and coreutils runs it. Fails if it is larger than 60 MB.
# Usage: make_kit.sh BUILD KIT
set -euo pipefail
build=$(realpath "$1") kit=$(realpath -m "$2")
cd "$(dirname "${BASH_SOURCE[0]}")"
readonly MOST_BYTES=60000000
# Parts of the C library. They must be of one version: the kit has all of them, and a machine uses all or none.
readonly LIBC='libc.so.6 libm.so.6 libdl.so.2 libpthread.so.0 libresolv.so.2 librt.so.1 libutil.so.1'

die() {
  echo "make_kit: $*" >&2
  exit 1
}

if [ -e "$kit" ] && [ -n "$(ls -A "$kit")" ] && [ ! -f "$kit/steps" ]; then
  die "$kit is not empty, and no kit that can be replaced"
fi
rm -rf "$kit"
mkdir -p "$kit/bin" "$kit/lib/libc" "$kit/lib/loader" "$kit/kept"
cp run steps ../../LICENSE "$kit/"
cp -r ../bench/results/*/ "$kit/kept/"
commit=$(git rev-parse --short HEAD 2>/dev/null) || commit=unknown
[ -z "$(git status --porcelain -uno 2>/dev/null)" ] || commit+=' with changes'
echo "$commit" >"$kit/commit"

# The first words of the commands are the programs.
programs=$(awk -F'|' '!/^#/ { for (i = 3; i <= 4; ++i) { split($i, word, " "); if (word[1]) print word[1] } }' steps | sort -u)
for program in gpu-kit-report $programs; do
  [ -x "$build/bin/$program" ] || die "$build has no program $program: build gpu_kit_programs"
  strip -o "$kit/bin/$program" "$build/bin/$program"
done

libraries=$(ldd "$kit"/bin/* | awk '$2 == "=>" { print $1, $3 }' | sort -u)
while read -r name path; do
  [ -f "$path" ] || die "$name is not installed here"
  [[ " $LIBC " == *" $name "* ]] || cp -L "$path" "$kit/lib/"
done <<<"$libraries"

# libstdc++ is linked statically: drivers load that of the machine, which may be newer than one in the kit.
[ ! -e "$kit/lib/libstdc++.so.6" ] || die 'a program does not link libstdc++ statically'

libc=$(dirname "$(awk '$1 == "libc.so.6" { print $2 }' <<<"$libraries")")
for name in $LIBC; do cp -L "$libc/$name" "$kit/lib/libc/"; done
cp -L "$(ldd "$kit/bin/gpu-kit-report" | awk '/ld-linux/ { print $1 }')" "$kit/lib/libc/ld.so"
loader=$(${CXX:-g++} -print-file-name=libvulkan.so.1)
[ -f "$loader" ] || die 'the Vulkan loader is not installed here: install libvulkan1'
cp -L "$loader" "$kit/lib/loader/"

bytes=$(du -sb "$kit" | cut -f1)
[ "$bytes" -le "$MOST_BYTES" ] || die "$kit has $bytes bytes; at most $MOST_BYTES are allowed"
echo "$kit has $((bytes / 1000000)) MB"
