#!/usr/bin/env bash
# Fails if a file includes something that its room must not see, if an arrow is not used, if a folder belongs to no
# room, or if headers include each other (docs/architecture.md: arrows point down only).
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

# room | the rooms of ours that it sees, in addition to itself. A file belongs to the longest room that contains it.
readonly ARROWS='
proto/parameters   |
proto/text         |
proto/tls          |
proto/discovery    |
proto/hands        |
proto/checksum     |
proto/ice          | proto/checksum
proto/dtls         | proto/tls
proto/sctp         | proto/checksum
server/files       |
server/model       | proto/codec proto/parameters
server/vulkan      |
proto/wire         |
proto/codec        |
proto/datagram     |
proto/recording    | proto/checksum proto/codec proto/wire clothstream
server/reference   | server/model
server/telemetry   | proto/text
server/simulation  | server/model server/vulkan shaders
server/meshes      | server/files server/model proto/text
server/messages    | server/files server/model server/meshes server/telemetry proto/hands proto/parameters proto/text clothstream
server/encode      | server/model server/simulation server/telemetry server/vulkan proto/codec shaders
server/schedule    |
server/delivery    | server/schedule server/encode server/messages server/telemetry proto/codec proto/datagram clothstream
server/scene       | server/delivery server/schedule server/model server/vulkan server/simulation server/encode server/messages server/telemetry clothstream
server/identity    | proto/tls server/files server/scene server/schedule server/messages clothstream
server/saved_state | server/files server/scene server/model server/messages server/telemetry clothstream
server/hosting     | proto/text server/identity server/scene server/delivery server/schedule server/model server/vulkan server/simulation server/messages server/telemetry clothstream
server/session     | server/hosting server/identity server/scene server/delivery server/schedule server/messages server/telemetry proto/codec clothstream
server/recording   | server/model server/vulkan server/simulation server/messages server/scene server/schedule server/telemetry proto/codec proto/recording proto/text clothstream
server/fleet       | server/session server/hosting server/saved_state server/scene server/schedule server/delivery server/recording server/messages server/telemetry proto/codec proto/datagram clothstream
server/agones      | server/hosting server/scene server/schedule server/telemetry
server/events      | server/files proto/text server/scene server/schedule server/telemetry
server/step        | server/model server/vulkan server/simulation server/messages
server/tls         | proto/tls server/files
server/discovery   | proto/discovery
server/doctor      | server/endpoint/datagram server/endpoint/listen server/encode server/messages server/model server/simulation server/tls server/vulkan
server/endpoint/listen | server/schedule server/telemetry
server/endpoint/grpc | server/endpoint/listen server/tls server/session server/hosting server/schedule server/telemetry clothstream grpc/health grpc/reflection
server/endpoint/web | server/endpoint/listen server/tls server/session server/hosting server/schedule server/telemetry
server/endpoint/datagram | server/endpoint/listen server/session server/hosting server/delivery server/schedule server/messages server/telemetry proto/datagram proto/dtls proto/ice proto/sctp
server/monitoring  | server/hosting server/scene server/telemetry server/endpoint/listen server/endpoint/web
server/options     | server/files proto/recording server/events server/hosting server/recording server/step server/scene server/model
server/program     | server/agones server/events server/fleet proto/recording proto/text server/options server/identity server/tls server/discovery server/doctor server/endpoint server/monitoring server/hosting server/saved_state server/recording server/step server/simulation server/messages server/model server/vulkan
server/main.cpp    | proto/text server/program server/options server/telemetry
clients/core       | proto/codec proto/parameters
clients/core/body  | clients/core/core.h clients/core/wire
clients/core/datagrams | clients/core/core.h clients/core/wire proto/codec proto/datagram
clients/core/stream | clients/core/core.h clients/core/wire proto/codec
clients/core/touch | clients/core/core.h clients/core/wire proto/codec proto/hands
clients/core/wire  | clients/core/core.h proto/codec proto/parameters proto/text proto/wire
clients/recording  | clients/core proto/codec proto/recording
clients/native     | clients/core proto/text
clients/grpc       | clients/core clients/native proto/tls clothstream
clients/websocket  | clients/native proto/text proto/tls
clients/websocket/winhttp | clients/websocket clients/native proto/text proto/tls
clients/datagram   | clients/core clients/native proto/dtls proto/ice proto/sctp
clients/library    | clients/datagram clients/native clients/grpc clients/websocket proto/tls
clients/testing    |
clients/files      | proto/codec proto/text clothstream
clients/measure    | clients/core
clients/load       | clients/core clients/datagram clients/native clients/grpc clients/websocket proto/codec clothstream
clients/cli        | proto/checksum proto/text proto/discovery clients/core clients/datagram clients/recording clients/native clients/grpc clients/files clients/load proto/codec proto/parameters proto/recording proto/tls clothstream clients/measure
clients/xr         | clients/xr/connection clients/xr/flat clients/xr/openxr
clients/xr/geometry |
clients/xr/text    |
clients/xr/timing  |
clients/xr/connection | proto/text
clients/xr/stage   | clients/xr/geometry clients/xr/text proto/hands
clients/xr/panel   | clients/xr/stage clients/xr/text
clients/xr/shaders |
clients/xr/render  | clients/xr/shaders clients/xr/stage
clients/xr/input   | clients/xr/geometry proto/hands
clients/xr/visit   | proto/text clients/xr/connection clients/xr/input clients/xr/panel clients/xr/stage clients/xr/timing
clients/xr/flat    | clients/xr/geometry clients/xr/render clients/xr/visit
clients/xr/openxr  | clients/xr/input clients/xr/render clients/xr/stage clients/xr/timing clients/xr/visit
'
# rooms that may include these headers
readonly OUTSIDE='
<vulkan/           | server/vulkan server/simulation server/encode
<grpcpp/           | server/endpoint/grpc clients/grpc clients/load
<boost/beast       | server/agones server/events server/endpoint/web server/monitoring clients/websocket
<prometheus/       | server/monitoring
<openssl/          | proto/dtls proto/ice proto/tls server/tls server/identity server/events server/scene
<jwt.h>            | server/identity
<sqlite3           | server/saved_state
<boost/asio/ssl    | server/tls server/events server/endpoint/web clients/websocket
<windows.h         | clients/websocket/winhttp
<winhttp.h         | clients/websocket/winhttp
<wincrypt.h        | clients/websocket/winhttp
<qrencode          | server/tls
<zip.h             | clients/files
<nats/             | server/fleet clients/cli
<avahi-            | server/discovery clients/cli
<Eigen/            | server/model server/reference clients/xr/geometry clients/xr/stage clients/xr/panel clients/xr/render clients/xr/flat clients/xr/shaders
<draco/            | server/meshes
<tiny_gltf         | server/meshes clients/cli
<tiny_obj          | server/meshes
<openxr/           | clients/xr/openxr
<volk.h            | clients/xr/openxr clients/xr/render
<GLFW/             | clients/xr/flat
<ft2build.h        | clients/xr/text
<fontconfig/       | clients/xr/text
'

failed=0
complain() { printf 'arrows: %s\n' "$*" && failed=1; }

# Every source of the rooms, generated and installed files left out, and its includes as FILE:LINE:#include ...
sources=$(find server clients proto -name node_modules -prune -o \( -name '*.h' -o -name '*.cpp' \) -print | sort)
includes=$(xargs grep -nHE '^#include ["<]' <<<"$sources")

awk -v arrows="$ARROWS" -v outside="$OUTSIDE" '
  function complain(text) { print "arrows: " text; failed = 1 }
  # Returns whether `path` is `place` or lies in it.
  function within(path, place) { return path == place || index(path, place "/") == 1 }
  function roomOf(file,    room, best) {
    for (room in seen) if (within(file, room) && length(room) > length(best)) best = room
    return best
  }
  # Splits lines of "name | places" into places[name].
  function readTable(text, places,    lines, count, i, parts) {
    count = split(text, lines, "\n")
    for (i = 1; i <= count; ++i) {
      if (split(lines[i], parts, "|") < 2) continue
      gsub(/ /, "", parts[1])
      places[parts[1]] = parts[2]
    }
  }
  function checkArrow(room, target,    places, count, i, allowed) {
    count = split(seen[room], places, " ")
    for (i = 1; i <= count; ++i) if (within(target, places[i])) allowed = used[room, places[i]] = 1
    return allowed || within(target, room)
  }
  function checkOutside(room, header,    prefix, places, count, i) {
    for (prefix in takers) {
      if (index(header, prefix) != 1) continue
      count = split(takers[prefix], places, " ")
      for (i = 1; i <= count; ++i) if (places[i] == room) return
      complain($1 ":" $2 ": only" takers[prefix] " may include " prefix "...>")
    }
  }
  BEGIN { FS = ":"; readTable(arrows, seen); readTable(outside, takers) }
  NF == 1 {
    folder = $1
    sub(/\/[^\/]*$/, "", folder)
    room = roomOf($1)
    holds[room] = 1
    if (room == "" && !(folder in homeless)) {
      homeless[folder] = 1
      complain(folder " belongs to no room; add it to the list in cmake/check_arrows.sh")
    }
    next
  }
  {
    room = roomOf($1)
    header = $3
    for (i = 4; i <= NF; ++i) header = header ":" $i
    sub(/^#include /, "", header)
    checkOutside(room, header)
    if (room == "" || header !~ /^"/) next
    split(header, parts, "\"")
    if (parts[2] !~ /^kernels\// && !checkArrow(room, parts[2])) complain($1 ":" $2 ": " room " must not see " parts[2])
  }
  END {
    for (room in seen) {
      if (!(room in holds)) complain(room " is in the list of cmake/check_arrows.sh, but has no sources; remove it")
      count = split(seen[room], places, " ")
      for (i = 1; i <= count; ++i)
        if (!((room, places[i]) in used)) complain("the arrow " room " -> " places[i] " is not used; remove it")
    }
    exit failed
  }' <<<"$sources
$includes" || failed=1

# No header includes itself by way of others.
edges=$(sed -nE 's/^([^:]+\.h):[0-9]+:#include "([^"]+\.h)".*/\2 \1/p' <<<"$includes")
cycle=$(tsort <<<"$edges" 2>&1 >/dev/null | sed -n 's/^tsort: \(.*\.h\)$/\1/p' | tr '\n' ' ' || true)
[ -z "$cycle" ] || complain "these headers include each other: $cycle"

# Commands print text of servers and files. print.h escapes what could control a terminal. Its functions may throw, so
# main.cpp prints the last exception with fprintf.
printing=$(grep -nE 'fmt::print\(|std::(cout|cerr|clog)|\b(v?f?printf|f?puts|f?putc|putchar|fwrite)\(' clients/cli/*.cpp clients/cli/*.h |
  grep -v -e '^clients/cli/print\.h:' -e '^clients/cli/main\.cpp:[0-9]*: *std::fprintf(stderr, .*printable(error\.what())' || true)
[ -z "$printing" ] || complain "print through clients/cli/print.h: $printing"

exit $failed
