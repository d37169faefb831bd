#!/usr/bin/env bash
# Makes a root with Debian 13, Monado and software Vulkan in the folder ROOT, or keeps the one that is there.
# Usage: make_root.sh ROOT
set -euo pipefail
root=$1
readonly PACKAGES=monado-service,libopenxr1-monado,libopenxr-loader1,openxr-layer-corevalidation,mesa-vulkan-drivers,vulkan-validationlayers,fontconfig-config,libfontconfig1,fonts-dejavu-core

[ "$(cat "$root/packages" 2>/dev/null || true)" != "$PACKAGES" ] || exit 0
rm -rf --one-file-system "$root"
mkdir -p "$(dirname "$root")"
mmdebstrap --quiet --mode=root --variant=apt --dpkgopt=force-unsafe-io --include="$PACKAGES" trixie "$root" \
  http://deb.debian.org/debian
printf %s "$PACKAGES" >"$root/packages"
