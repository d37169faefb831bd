#!/usr/bin/env bash
# Makes a root with a release of Debian, and runs there what a new user runs first: `./dev run` until it serves its page,
# and `./dev test`. Packages come from Debian and npm.
# Usage: first_commands.sh RELEASE SOURCE CACHE. RELEASE is a codename; CACHE keeps what was compiled.
set -euo pipefail
release=$1 source=$2 cache=$3
readonly kSkipped=77 # CMake's SKIP_RETURN_CODE for this test

for tool in mmdebstrap git unshare; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is missing (./dev test --long installs it)"; exit $kSkipped; }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: only root can install a Debian into a folder"; exit $kSkipped; }
git -C "$source" rev-parse >/dev/null 2>&1 || { echo "skipped: $source is no git checkout"; exit $kSkipped; }

work=$(mktemp -d)
trap 'rm -rf --one-file-system "$work"' EXIT
root=$work/root

echo "Installing Debian $release"
mmdebstrap --quiet --mode=root --variant=minbase --include=ca-certificates,curl --dpkgopt=force-unsafe-io "$release" "$root" \
  http://deb.debian.org/debian
# Nothing starts services here. Names and authorities are those of this machine.
printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
chmod +x "$root/usr/sbin/policy-rc.d"
cp -L /etc/hosts /etc/resolv.conf "$root/etc/"
cp /etc/ssl/certs/ca-certificates.crt "$root/etc/ssl/certs/"

mkdir -p "$root/clothstream" "$root/ccache" "$cache"
git -C "$source" ls-files -z --cached --others --exclude-standard |
  tar -C "$source" --null --files-from=- --ignore-failed-read -c 2>/dev/null | tar -C "$root/clothstream" -x

cat >"$root/first_commands" <<'INSIDE'
set -euo pipefail
cd /clothstream
echo "./dev run"
set -m # jobs get a process group and may be interrupted, as in a terminal
./dev run --port 0 --grpc-port 0 >/tmp/run.log 2>&1 &
run=$!
until page=$(grep -oE 'http://127\.0\.0\.1:[0-9]+' /tmp/run.log | head -1) && [ -n "$page" ]; do
  kill -0 $run 2>/dev/null || { tail -100 /tmp/run.log && exit 1; }
  sleep 1
done
curl -sS --fail "$page/" | grep -q '<title>ClothStream'
curl -sS --fail -o /dev/null "$page/clothstream_core.wasm"
kill -INT -- -$run
wait $run || { tail -100 /tmp/run.log && exit 1; }
echo "./dev test"
./dev test
INSIDE
# The namespaces end with the test: nothing stays mounted and nothing goes on running. Without /sys, malloc() may set
# errno, and gRPC, which reads the result of connect() there after other calls, fails to connect.
unshare --mount --pid --fork --kill-child bash -euc '
  root=$1 cache=$2
  mount -t proc proc "$root/proc"
  mount --rbind /dev "$root/dev"
  mount --rbind /sys "$root/sys"
  mount --bind "$cache" "$root/ccache"
  exec chroot "$root" env -i HOME=/root LC_ALL=C.UTF-8 PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
    CCACHE_DIR=/ccache NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt bash /first_commands
' _ "$root" "$cache"
