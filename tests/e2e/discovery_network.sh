#!/bin/bash
# Runs a command in a new network namespace with one interface, a D-Bus and an Avahi daemon. Needs root.
# discovery_network.sh DIRECTORY COMMAND [ARGUMENTS]: DIRECTORY is for files of the daemons.
set -eu
if [ -z "${IN_NAMESPACE:-}" ]; then
  IN_NAMESPACE=1 exec unshare --net --mount-proc --pid --fork --kill-child "$0" "$@"
fi
directory=$1
shift
ip link set lo up
ip link add home type veth peer name other
ip addr add 192.0.2.2/24 dev home
ip link set home up
ip link set other up

cat >"$directory/bus.conf" <<END
<!DOCTYPE busconfig PUBLIC "-//freedesktop//DTD D-Bus Bus Configuration 1.0//EN"
 "http://www.freedesktop.org/standards/dbus/1.0/busconfig.dtd">
<busconfig>
  <type>system</type>
  <listen>unix:path=$directory/bus</listen>
  <policy context="default">
    <allow send_destination="*" eavesdrop="true"/>
    <allow eavesdrop="true"/>
    <allow own="*"/>
    <allow user="*"/>
  </policy>
</busconfig>
END
export DBUS_SYSTEM_BUS_ADDRESS=unix:path=$directory/bus
dbus-daemon --config-file="$directory/bus.conf" --nofork --nopidfile &
while [ ! -S "$directory/bus" ]; do sleep 0.05; done

# Avahi has one fixed place for its socket and pid.
mkdir -p /run/avahi-daemon
mount -t tmpfs none /run/avahi-daemon
cat >"$directory/avahi.conf" <<END
[server]
host-name=workshop
use-ipv6=no
allow-interfaces=home
[wide-area]
enable-wide-area=no
END
avahi-daemon --file="$directory/avahi.conf" --no-drop-root --no-rlimits --no-chroot &
echo $! >"$directory/avahi.pid"
"$@"
