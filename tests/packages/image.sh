#!/usr/bin/env bash
# Builds the OCI image and runs it as compose.yaml does: another user, a read-only root, no rights. The page comes through
# caddy with TLS, and a client joins; the state survives a new container.
# Usage: image.sh BUILD SOURCE
set -euo pipefail
build=$(realpath "$1") source=$2
readonly kSkipped=77 # CMake's SKIP_RETURN_CODE for this test

for tool in reprepro mmdebstrap help2man buildah podman runc caddy amtool docker-compose curl; do
  command -v "$tool" >/dev/null || { echo "skipped: $tool is missing (./dev test --long installs it)"; exit $kSkipped; }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: only root can install a Debian into a folder"; exit $kSkipped; }

work=$(mktemp -d)
podman() { command podman --root "$work/storage" --runroot "$work/run" --storage-driver vfs --cgroup-manager cgroupfs --runtime runc "$@"; }
caddy=
finish() {
  [ -z "$caddy" ] || kill "$caddy" 2>/dev/null || true
  podman rm --force --all >/dev/null 2>&1 || true
  rm -rf "$work"
}
trap finish EXIT

echo "Building the image"
"$source/deploy/debian/make_repository.sh" "$build" "$work/apt"
chmod -R a+rX "$work"
"$source/deploy/image/build_image.sh" "$work/apt" "$work/image.oci.tar"
podman load --quiet --input "$work/image.oci.tar"
image=$(podman images --format '{{.Repository}}:{{.Tag}}' | head -1)
[ "$(podman image inspect --format '{{.Config.User}}' "$image")" = 10001:10001 ] || { echo "the image runs as root"; exit 1; }

mkdir -p "$work/states" "$work/shaders"
chown 10001:10001 "$work/states" "$work/shaders"
start() {
  podman run --detach --name server --network host --ulimit nofile=4096:4096 --ulimit nproc=4096:4096 --read-only --tmpfs /tmp --cap-drop ALL \
    --security-opt no-new-privileges --volume "$work/states:/var/lib/clothstream" \
    --volume "$work/shaders:/var/cache/clothstream" "$image" --port 18080 --grpc-port 15051 --insecure >/dev/null
  for ((i = 0; i < 300; ++i)); do
    ! curl -sS --fail -o /dev/null http://127.0.0.1:18080/ 2>/dev/null || return 0
    sleep 0.2
  done
  podman logs server
  exit 1
}
# Joins and prints the newest tick. Every frame must decode to what the server has.
tickAt() { # address arguments...
  "$build/bin/clothstream" join "$1" --scene flag --seconds 3 --hash --json "${@:2}" >"$work/summary"
  python3 -c 'import json, sys
summary = json.load(sys.stdin)
assert summary["frames"] > 10 and summary["hashMismatches"] == 0 and summary["decodeErrors"] == 0, summary
print(summary["ticks"])' <"$work/summary"
}

echo "Running it"
start
podman exec server /usr/bin/clothstream-server --version
[ "$(podman exec server id -u)" = 10001 ] || { echo "the server runs as root"; exit 1; }
! podman exec server sh -c 'echo > /usr/bin/written' 2>/dev/null || { echo "the root is not read-only"; exit 1; }

echo "Through a proxy with TLS"
sed "s/:8080/:18080/; s/{\$CLOTHSTREAM_NAME:localhost}:50051/{\$CLOTHSTREAM_NAME:localhost}:15443/; s/127.0.0.1}:50051/127.0.0.1}:15051/; s/^{\$CLOTHSTREAM_NAME:localhost} {/{\$CLOTHSTREAM_NAME:localhost}:18443 {/" \
  "$source/deploy/image/Caddyfile" >"$work/Caddyfile"
XDG_DATA_HOME=$work/caddy caddy run --adapter caddyfile --config "$work/Caddyfile" >"$work/caddy.log" 2>&1 &
caddy=$!
authority=$work/caddy/caddy/pki/authorities/local/root.crt
for ((i = 0; i < 100; ++i)); do
  ! { [ -f "$authority" ] && curl -sS --fail --cacert "$authority" -o "$work/page" https://localhost:18443/ 2>/dev/null; } || break
  sleep 0.2
done
grep -q '<title>ClothStream' "$work/page"
tick=$(tickAt https://localhost:15443 --ca "$authority")

echo "Going on in a new container"
podman stop --time 20 server >/dev/null
[ "$(podman inspect --format '{{.State.ExitCode}}' server)" = 0 ] || { podman logs server; exit 1; }
podman rm server >/dev/null
start
later=$(tickAt 127.0.0.1:15051)
[ "$later" -gt "$tick" ] || { echo "the scene began again: tick $later after $tick"; exit 1; }

echo "The other parts"
amtool check-config "$source/deploy/image/alertmanager.yml" >/dev/null
CLOTHSTREAM_NAME=cloth.example.org docker-compose --file "$source/deploy/image/compose.yaml" config >"$work/compose"
grep -q 'public-name=cloth.example.org' "$work/compose"
CLOTHSTREAM_NAME=cloth.example.org CLOTHSTREAM_ADDRESS=192.0.2.1 docker-compose --file "$source/deploy/image/compose.yaml" config >"$work/addressed"
grep -q 'CLOTHSTREAM_PUBLIC_ADDRESS.*192.0.2.1' "$work/addressed"
grep -q '8080:8080/udp\|protocol: udp' "$work/addressed"
grep -q "image: ${image#localhost/}\$" "$work/compose" || { echo "compose.yaml names another image than $image"; exit 1; }
! docker-compose --file "$source/deploy/image/compose.yaml" config >/dev/null 2>"$work/problem" || { echo "a name is needed"; exit 1; }
grep -q 'the name of this machine' "$work/problem"
