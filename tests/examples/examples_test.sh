#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Runs an example of examples/testing as a stranger does, with an installed ClothStream: it passes, and fails when one
# byte of the recording is changed. Usage: examples_test.sh gtest|pytest|vitest CMAKE SOURCE PREFIX
set -euo pipefail
example=$1 cmake=$2 source=$3 prefix=$4
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cp -r "$source/examples/testing/." "$folder"
cd "$folder"

export CLOTHSTREAM_SERVER=$prefix/bin/clothstream-server
library=$(find "$prefix" -name 'libclothstream.so.?.?')
case $example in
  gtest)
    "$cmake" -S gtest -B build -DCMAKE_PREFIX_PATH="$prefix" >/dev/null
    "$cmake" --build build >/dev/null
    run() { build/cloth_test; }
    ;;
  pytest)
    cd pytest
    cp "$source/tests/examples/test_fixtures.py" .
    run() {
      LIBCLOTHSTREAM=$library PYTHONPATH=$prefix/share/clothstream/python /usr/bin/python3 -B -m pytest -q \
        -p no:cacheprovider
    }
    ;;
  vitest)
    cd vitest
    cp "$source/tests/examples/fixtures.test.ts" .
    # As npm does it, but without a network. Everything else that the project needs is installed in the repository.
    mkdir -p node_modules/@clothstream/client
    tar -xzf "$prefix"/share/clothstream/packages/clothstream-client-*.tgz -C node_modules/@clothstream/client \
      --strip-components=1
    for name in vitest ws; do ln -s "$source/clients/web/node_modules/$name" "node_modules/$name"; done
    run() { node node_modules/vitest/vitest.mjs run; }
    ;;
esac

if ! run >"$folder/log" 2>&1; then
  echo "$example: the example fails:"
  cat "$folder/log"
  exit 1
fi
cat "$folder/log"

# fails WHY TEXT: the example fails, and prints this text.
fails() {
  if run >"$folder/log" 2>&1; then
    echo "$example: the example passes with $1:"
  elif grep -q "$2" "$folder/log"; then
    echo "$example: fails with $1, and prints '$2'"
    return
  else
    echo "$example: with $1, the example does not print '$2':"
  fi
  cat "$folder/log"
  exit 1
}
cp "$folder/cloth.frames" "$folder/expected"
sed -i '2s/^[0-9]*/7/' "$folder/cloth.frames"
fails "another expected tick" "Log of clothstream-server"
mv "$folder/expected" "$folder/cloth.frames"

/usr/bin/python3 - "$folder/cloth.mcap" <<'END'
import sys
from pathlib import Path
path = Path(sys.argv[1])
data = bytearray(path.read_bytes())
data[len(data) // 2] ^= 1
path.write_bytes(data)
END
fails "one changed byte in the recording" "checksum"
