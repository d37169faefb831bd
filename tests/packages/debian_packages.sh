#!/usr/bin/env bash
# Builds the Debian packages, checks them with lintian, and installs them on a fresh Debian of this release from an APT
# repository. There the server serves its page, a program is compiled with the library, and nothing is left after a purge.
# Usage: debian_packages.sh BUILD SOURCE
set -euo pipefail
build=$1 source=$2
readonly kSkipped=77 # CMake's SKIP_RETURN_CODE for this test

for tool in lintian reprepro mmdebstrap help2man curl; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is missing (apt install $tool)"; exit $kSkipped; }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: only root can install a Debian into a folder"; exit $kSkipped; }

work=$(mktemp -d)
server=
finish() {
  [ -z "$server" ] || kill "$server" 2>/dev/null || true
  ! mountpoint -q "$work/root/proc" || umount "$work/root/proc"
  rm -rf "$work"
}
trap finish EXIT

echo "Packing"
"$source/deploy/debian/make_repository.sh" "$build" "$work/apt"
chmod -R a+rX "$work"
mapfile -t packages < <(find "$work/apt/pool" -name '*.deb')
ls -l "${packages[@]}"
names="clothstream-client clothstream-server libclothstream libclothstream-dev"
! grep -q '^CLOTHSTREAM_XR:BOOL=ON' "$build/CMakeCache.txt" || names="clothstream-client clothstream-server clothstream-xr libclothstream libclothstream-dev"
[ "$(basename -a "${packages[@]}" | sed -E 's/_.*//; s/^(libclothstream)[0-9.]+$/\1/' | sort | xargs)" = "$names" ] ||
  { echo "there should be the packages $names"; exit 1; }

echo "Checking with lintian"
lintian --fail-on error,warning --allow-root --tag-display-limit 0 "${packages[@]}"

release=$(sed -n 's/^Codename: //p' "$work/apt/conf/distributions")
echo "Installing Debian $release"
root=$work/root
mmdebstrap --quiet --mode=root --variant=minbase --include=gcc,libc6-dev,pkg-config "$release" "$root" \
  http://deb.debian.org/debian
mkdir -p "$root/apt"
cp -r "$work/apt/." "$root/apt/"
echo "deb [trusted=yes] file:///apt $release main" >"$root/etc/apt/sources.list.d/clothstream.list"
# Nothing starts services here.
printf '#!/bin/sh\nexit 101\n' >"$root/usr/sbin/policy-rc.d"
chmod +x "$root/usr/sbin/policy-rc.d"
mount -t proc proc "$root/proc"
inside() { chroot "$root" env DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 "$@"; }
inside apt-get -qq update
inside apt-get -qq -y --no-install-recommends install clothstream-server libclothstream-dev >/dev/null

echo "Using it"
version=$(inside dpkg-query -W -f '${Version}' clothstream-server)
version=${version%+deb*} # the rest names the release of Debian
inside clothstream-server --version | grep -qF "$version"
inside clothstream --version | grep -qF "$version"
[ -s "$root/usr/lib/systemd/system/clothstream-server.service" ]
grep -q 'ExecStart=/usr/bin/clothstream-server' "$root/usr/lib/systemd/system/clothstream-server.service"
zgrep -q 'clothstream-server' "$root/usr/share/man/man1/clothstream-server.1.gz"
# Without a shell between, which would take the signal.
chroot "$root" env CLOTHSTREAM_CACHE_DIR=/tmp/cache clothstream-server --config /etc/clothstream/server.toml --port 0 --grpc-port 0 >"$work/server.log" 2>&1 &
server=$!
for ((i = 0; i < 300; ++i)); do
  page=$(grep -oE 'http://127\.0\.0\.1:[0-9]+' "$work/server.log" | head -1 || true)
  [ -z "$page" ] || break
  kill -0 "$server" 2>/dev/null || break
  sleep 0.2
done
[ -n "${page:-}" ] || { echo "the server did not start:"; cat "$work/server.log"; exit 1; }
curl -sS --fail "$page/" | grep -q '<title>ClothStream'
curl -sS --fail -o /dev/null "$page/main.js"
cat >"$root/program.c" <<'C'
#include <clothstream/clothstream.h>
#include <stdio.h>
int main(void) {
  puts(clothstream_version());
  return 0;
}
C
inside sh -c 'gcc /program.c -o /program $(pkg-config --cflags --libs clothstream) && /program' | grep -qF "$version"
rm "$root/program.c" "$root/program"
kill -TERM "$server"
wait "$server" || { echo "the server ended with an error:"; cat "$work/server.log"; exit 1; }
server=

echo "Removing it"
mapfile -t installed < <(inside dpkg-query -W -f '${Package}\n' | grep clothstream)
[ ${#installed[@]} -eq 4 ] || { echo "${installed[*]} are installed, which should be four"; exit 1; }
# Where systemd keeps the state of the unit.
mkdir -p "$root/var/lib/private/clothstream/states"
ln -s private/clothstream "$root/var/lib/clothstream"
inside apt-get -qq -y purge "${installed[@]}" >/dev/null
left=$(cd "$root" && find . -xdev -path ./apt -prune -o -path ./var/lib/apt -prune -o -path ./var/log -prune -o \
  -name '*clothstream*' ! -path ./etc/apt/sources.list.d/clothstream.list -print)
[ -z "$left" ] || { printf 'the packages left files:\n%s\n' "$left"; exit 1; }
