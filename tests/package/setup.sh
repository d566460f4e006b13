#!/bin/bash
# setup.sh DIR: makes in DIR a fresh Debian with systemd, spacenavd and the libraries that the package depends on: the machine
# that clean_guest.sh installs the package on. Takes root, 1 GB and a minute or two. A second call returns at once.
set -eu
[ $# -eq 1 ] || { echo "usage: setup.sh DIR" >&2; exit 2; }
dir=$1
[ ! -e "$dir/ready" ] || exit 0
[ "$(id -u)" -eq 0 ] || { echo "a fresh Debian is made by root: sudo $0 $dir" >&2; exit 1; }
[ -x /usr/sbin/debootstrap ] || { echo "install the Debian package debootstrap" >&2; exit 1; }
deb=$(find "$(dirname "$dir")/package" -name 'tagwrench_*.deb' 2>/dev/null | tail -n 1)
[ -n "$deb" ] || { echo "what the package depends on is not known: ./run package makes it" >&2; exit 1; }
mkdir -p "$dir"
rm -rf "$dir/root"
debootstrap --variant=minbase \
  --include=systemd,systemd-sysv,libpam-systemd,dbus,dbus-user-session,udev,kmod,login,spacenavd,libspnav0 \
  bookworm "$dir/root" > "$dir/log"
# The archive that this machine takes its packages from, for security updates, too.
if cp /etc/apt/sources.list.d/debian.sources "$dir/root/etc/apt/sources.list.d/" 2>> "$dir/log"; then
  : > "$dir/root/etc/apt/sources.list"
fi
mapfile -t depends < <(dpkg-deb -f "$deb" Depends | sed 's/([^)]*)//g; s/|[^,]*//g; s/,/\n/g' | tr -d ' ' | grep .)
chroot "$dir/root" apt-get update >> "$dir/log" 2>&1
DEBIAN_FRONTEND=noninteractive chroot "$dir/root" apt-get install -y --no-install-recommends "${depends[@]}" >> "$dir/log" 2>&1
touch "$dir/ready"
