#!/usr/bin/env bash
# Fails if a file includes something that its room must not see, or if headers of a room include each other
# (docs/architecture.md: arrows point down only).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# room | the rooms of ours that it sees, in addition to itself
readonly ARROWS='
proto/parameters   |
server/model       | proto/parameters
server/vulkan      |
proto/codec        |
proto/recording    | proto/codec clothstream
server/reference   | server/model
server/telemetry   |
server/simulation  | server/model server/vulkan shaders
server/meshes      | server/model
server/messages    | server/model server/meshes proto/parameters clothstream
server/encode      | server/model server/simulation server/vulkan proto/codec shaders
server/schedule    |
server/delivery    | server/schedule server/encode server/messages server/telemetry proto/codec clothstream
server/scene       | server/delivery server/schedule server/model server/vulkan server/simulation server/encode server/messages server/telemetry clothstream
server/hosting     | server/scene server/delivery server/schedule server/model server/vulkan server/simulation server/messages server/telemetry clothstream
server/session     | server/hosting server/scene server/delivery server/schedule server/messages proto/codec clothstream
server/recording   | proto/parameters server/model server/vulkan server/simulation server/messages server/scene server/delivery server/schedule proto/codec proto/recording clothstream
server/step        | server/model server/vulkan server/simulation server/messages
server/endpoint/grpc | server/session server/hosting server/delivery clothstream grpc/health
server/endpoint/web | server/session server/hosting server/delivery clothstream
clients/core       | proto/codec proto/parameters
clients/core/stream | clients/core/core.h clients/core/wire proto/codec
clients/core/wire  | clients/core/core.h proto/codec proto/parameters
clients/grpc       | clients/core clothstream
clients/library    | clients/core clients/grpc
clients/files      | proto/codec clothstream
clients/load       | clients/core clients/grpc proto/codec clothstream
clients/cli        | clients/core clients/grpc clients/files clients/load proto/codec proto/parameters proto/recording clothstream
'
# rooms that may include these headers
readonly OUTSIDE='
<vulkan/           | server/vulkan server/simulation server/encode
<grpcpp/           | server/endpoint/grpc clients/grpc clients/load
<boost/beast       | server/endpoint/web clients/load
<Eigen/            | server/model server/reference
'

failed=0
complain() { printf 'arrows: %s\n' "$*" && failed=1; }

while IFS='|' read -r room seen; do
  room=$(echo "$room" | xargs)
  [ -n "$room" ] && [ -d "$room" ] || continue
  while IFS=: read -r file line include; do
    target=$(sed -E 's/.*"([^"]+)".*/\1/' <<<"$include")
    case "$target" in kernels/*) continue ;; esac
    allowed=no
    for prefix in "$room" $seen; do
      case "$target" in "$prefix" | "$prefix"/*) allowed=yes ;; esac
    done
    [ $allowed = yes ] || complain "$file:$line: $room must not see $target"
  done < <(grep -rnE '^#include "' --include='*.h' --include='*.cpp' "$room" || true)
done <<<"$ARROWS"

while IFS='|' read -r header rooms; do
  header=$(echo "$header" | xargs)
  [ -n "$header" ] || continue
  while IFS=: read -r file line _; do
    allowed=no
    for room in $rooms; do
      case "$file" in "$room"/*) allowed=yes ;; esac
    done
    [ $allowed = yes ] || complain "$file:$line: only ${rooms# } may include $header...>"
  done < <(grep -rnF "#include $header" --include='*.h' --include='*.cpp' server clients proto || true)
done <<<"$OUTSIDE"

# Headers inside a room form no cycle; an upward arrow always closes one.
while IFS='|' read -r room _; do
  room=$(echo "$room" | xargs)
  case "$room" in server/* | clients/core) ;; *) continue ;; esac
  edges=$(grep -rE "^#include \"$room/[^\"]+\.h\"" --include='*.h' "$room" |
    sed -E 's/^([^:]+):#include "([^"]+)".*/\2 \1/' || true)
  cycle=$(tsort <<<"$edges" 2>&1 >/dev/null | sed -n 's/^tsort: \(.*\.h\)$/\1/p' | tr '\n' ' ' || true)
  [ -z "$cycle" ] || complain "$room: these headers include each other: $cycle"
done <<<"$ARROWS"

exit $failed
