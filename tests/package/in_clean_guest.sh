#!/bin/bash
# in_clean_guest.sh RIG ROOT PACKAGES PROGRAMS FRAMES: runs clean_guest.sh in a guest whose root is the fresh Debian in ROOT.
here=$(dirname "$(readlink -f "$0")")
rig=$1 root=$2
if [ ! -e "$root/ready" ]; then
  echo "the package is not tried on a fresh Debian: tests/package/setup.sh $root makes one (root, 1 GB, some minutes)"
  exit 77
fi
deb=$(echo "$3"/tagwrench_*.deb)
exec "$here/../kernel/vm" -t 580 -r "$root/root" "$rig" bash "/host$here/clean_guest.sh" "/host$deb" "/host$4" "/host$5"
