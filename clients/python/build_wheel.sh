#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Builds the wheel without a network. Usage: build_wheel.sh PYTHON LIBRARY VERSION FOLDER
# PYTHON has the modules build, setuptools and wheel; LIBRARY is libclothstream.so, which the wheel contains.
set -euo pipefail
python=$1 library=$2 version=$3 folder=$4
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
staging=$(mktemp -d)
trap 'rm -rf "$staging"' EXIT

cp -r "$here/src" "$here/pyproject.toml" "$here/setup.py" "$here/README.md" "$staging"
find "$staging" -name __pycache__ -prune -exec rm -r {} +
strip --strip-unneeded -o "$staging/src/clothstream/libclothstream.so" "$library"
for package in libssl-dev libzstd-dev libprotozero-dev libboost-dev libexpected-dev libsimde-dev libstdc++6; do
  printf '%s\n%s\n\n' "$package" "$(printf '=%.0s' {1..80})"
  cat "/usr/share/doc/$package/copyright"
done >"$staging/src/clothstream/THIRD_PARTY_LICENSES.txt"

# Only libraries of glibc may be needed at run time: pip installs the wheel on systems without others.
needed=$(objdump -p "$library" | sed -n 's/^ *NEEDED *//p')
other=$(grep -vE '^(libc|libm|libdl|libpthread|librt|libresolv)\.so\.[0-9]+$|^ld-linux-' <<<"$needed" || true)
[ -z "$other" ] || { echo "build_wheel.sh: $library needs $other, which a manylinux wheel must not" >&2 && exit 1; }
# The newest version of glibc that the library refers to is the lowest one on which it runs.
glibc=$(objdump -T "$library" | sed -n 's/.*(\?GLIBC_\([0-9.]*\))\? .*/\1/p' | sort -Vu | tail -1)

export CLOTHSTREAM_VERSION=$version CLOTHSTREAM_PLATFORM=manylinux_${glibc//./_}_$(uname -m)
mkdir -p "$folder"
rm -f "$folder"/clothstream-*.whl
(cd "$staging" && "$python" -m build --wheel --no-isolation --outdir "$staging/out" >"$staging/log" 2>&1) || { cat "$staging/log" >&2 && exit 1; }
mv "$staging"/out/*.whl "$folder"
ls "$folder"/clothstream-*.whl
