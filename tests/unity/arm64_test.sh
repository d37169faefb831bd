#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# The core of the package for Unity compiles for ARM64 with libc++, and has no fused operations, which would change bits.
# Usage: arm64_test.sh CLANG LIBRARY OPTION...   (LIBRARY: ClothStreamCore.androidlib of the package)
set -euo pipefail
clang=$1 library=$2
shift 2
if ! command -v aarch64-linux-gnu-objdump >/dev/null || ! [ -d /usr/aarch64-linux-gnu/include ]; then
  echo "skipped: no cross compiler; ./dev test --long installs Debian's g++-aarch64-linux-gnu"
  exit 77
fi
object=$(mktemp)
trap 'rm -f "$object"' EXIT
"$clang" --target=aarch64-linux-gnu -stdlib=libc++ "$@" -fPIC -I"$library/cpp" -c -o "$object" \
  "$library/cpp/clothstream_core.cpp"
code=$(aarch64-linux-gnu-objdump -d "$object")
multiplications=$(grep -cE '\sfmul\s' <<<"$code")
fused=$(grep -cE '\s(fmadd|fmsub|fnmadd|fnmsub|fmla|fmls)\s' <<<"$code" || true)
echo "$multiplications multiplications, $fused fused operations"
[ "$multiplications" -gt 0 ] && [ "$fused" -eq 0 ]
