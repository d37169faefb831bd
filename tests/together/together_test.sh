#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Prepares the clients of together.test.mjs and runs it: C here, on Windows (Wine) and on arm64 (QEMU), Python, and C#.
# Usage: together_test.sh CMAKE SOURCES BUILD SERVER CLIENT FOLLOW LIBRARY UNITY_CORE PYTHON NODE
# BUILD: folder of the whole build. FOLLOW: follow.c for this machine. LIBRARY, UNITY_CORE: libclothstream.so, and the core
# of the package for Unity.
set -euo pipefail
cmake=$1 sources=$2 build=$3 follow=$6 unity_core=$8 python=$9 node=${10}
export CLOTHSTREAM_SERVER=$4 CLOTHSTREAM=$5 CLOTHSTREAM_LIBRARY=$7
here=$sources/tests/together
. "$sources/tests/library/platform.sh"
need mcs mono-mcs
need mono mono-runtime
folder=$(mktemp -d)
trap 'stopWine; rm -rf "$folder"' EXIT

for each in windows-x64 linux-arm64; do
  mkdir "$folder/$each"
  needPlatform "$each"
  buildLibrary "$build/$each" "$folder/$each/prefix"
  compileProgram "$here/follow.c" "$folder/$each/prefix" "$folder/$each/follow.exe"
done
arm64=${library%/*}
startWine "$folder/wine"
mcs -unsafe -langversion:7 -out:"$folder/Follow.exe" "$here/Follow.cs" "$build"/packages/com.clothstream.client/Runtime/Core/*.cs

TOGETHER=$(
  "$python" - "$follow" "$wine" "$folder" "$arm64" "$python" "$here/follow.py" "$unity_core" <<'END'
import json, os, sys
follow, wine, folder, arm64, python, script, core = sys.argv[1:]
print(json.dumps({
    "C": [follow],
    "C on Windows (Wine)": [wine, f"{folder}/windows-x64/follow.exe"],
    "C on arm64 (QEMU)": ["qemu-aarch64", "-L", "/", "-E", f"LD_LIBRARY_PATH={arm64}", f"{folder}/linux-arm64/follow.exe"],
    "Python": [python, "-B", script],
    "C# (Mono)": ["env", f"LD_LIBRARY_PATH={os.path.dirname(core)}", "mono", f"{folder}/Follow.exe"],
}))
END
)
export TOGETHER PYTHONPATH=$sources/clients/python/src
"$node" --test "$here/together.test.mjs"
