#!/usr/bin/env bash
# SPDX-License-Identifier: MIT
# Installs the wheel in a new virtual environment without a network, and runs package_test.py there.
# Usage: wheel_test.sh PYTHON PACKAGES INCLUDE SERVER CLOTHSTREAM
set -euo pipefail
python=$1 packages=$2
export CLOTHSTREAM_INCLUDE=$3 CLOTHSTREAM_SERVER=$4 CLOTHSTREAM_PROGRAM=$5
unset PYTHONPATH CLOTHSTREAM_LIBRARY
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
"$python" -c 'import numpy, venv, ensurepip' 2>/dev/null || { echo "skipped: $python has no numpy or no venv" && exit 77; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

"$python" -m venv --system-site-packages "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-index --no-deps "$packages"/clothstream-*.whl
cd "$folder"
"$folder/venv/bin/python" -B "$here/package_test.py" -v
