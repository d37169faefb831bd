#!/usr/bin/env bash
# Builds the OCI image of the server from the packages in an APT repository (`./dev image`), on the release of Debian that
# the packages are for. It has Debian's software Vulkan, and what NVIDIA's driver needs; the host brings the driver of a
# GPU (docs/operations.md).
# Usage: build_image.sh APT ARCHIVE
set -euo pipefail
apt=$(realpath "$1") archive=$(realpath -m "$2")
release=$(sed -n 's/^Codename: //p' "$apt/conf/distributions")
readonly kUser=10001

work=$(mktemp -d)
container=
finish() {
  [ -z "$container" ] || buildah rm "$container" >/dev/null || true
  rm -rf "$work"
}
trap finish EXIT
export STORAGE_DRIVER=vfs BUILDAH_ISOLATION=chroot

# Only what the server needs, besides Debian's essential packages. Manuals and translations stay out.
mmdebstrap --quiet --mode=root --variant=essential --include=clothstream-server,libegl1,libgl1,libx11-6,libxext6 \
  --aptopt='Apt::Install-Recommends "false"' \
  --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
  --dpkgopt='path-exclude=/usr/share/doc/*' --dpkgopt='path-include=/usr/share/doc/*/copyright' \
  --customize-hook='rm -rf "$1"/var/lib/apt/lists/* "$1"/var/cache/apt/* "$1"/var/log/*' \
  --customize-hook='install -d -o '$kUser' -g '$kUser' -m 700 "$1/var/lib/clothstream" "$1/var/cache/clothstream"' \
  "$release" "$work/root.tar" "deb http://deb.debian.org/debian $release main" \
  "deb [trusted=yes] copy:$apt $release main"

version=$(tar -xOf "$work/root.tar" ./var/lib/dpkg/status |
  awk '/^Package: / { found = $2 == "clothstream-server" } found && /^Version: / { sub(/\+deb.*/, "", $2); print $2 }')
container=$(buildah from scratch)
buildah add --quiet "$container" "$work/root.tar" / >/dev/null
buildah config --user $kUser:$kUser --workingdir /var/lib/clothstream --port 8080/tcp --port 8080/udp --port 50051/tcp \
  --volume /var/lib/clothstream --volume /var/cache/clothstream \
  --env CLOTHSTREAM_STATE_DIR=/var/lib/clothstream --env CLOTHSTREAM_CACHE_DIR=/var/cache/clothstream \
  --env NVIDIA_VISIBLE_DEVICES=all --env NVIDIA_DRIVER_CAPABILITIES=graphics,compute,utility \
  --entrypoint '["/usr/bin/clothstream-server"]' --cmd '' --stop-signal TERM \
  --label org.opencontainers.image.title=clothstream-server \
  --label org.opencontainers.image.version="$version" --label org.opencontainers.image.licenses=MIT "$container"
rm -f "$archive"
buildah commit --quiet --rm=false "$container" "oci-archive:$archive:clothstream-server:$version" >/dev/null
ls -l "$archive"
