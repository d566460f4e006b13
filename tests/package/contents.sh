#!/bin/bash
# contents.sh FOLDER PROGRAM: the packages in FOLDER hold what they should, owned by root and read by all, and nothing for
# development in what users get.
set -eu
folder=$1 program=$2
failed=0
wrong() { echo "WRONG: $*"; failed=1; }

list=$(dpkg-deb -c "$folder"/tagwrench_*.deb)
has() { grep -q " \./$1\$" <<< "$list" || wrong "there is no $1"; }
has usr/bin/tagwrench
has usr/lib/udev/rules.d/70-tagwrench.rules
! grep 'rules.d/71-' <<< "$list" || wrong "the rule that lets people type is in force"
has usr/share/doc/tagwrench/examples/71-tagwrench-direct.rules
has usr/lib/sysusers.d/tagwrench.conf
has usr/lib/systemd/system/tagwrench-devices.socket
has usr/lib/systemd/system/tagwrench-devices@.service
has usr/lib/tagwrench/tagwrench-devices
has usr/lib/modules-load.d/tagwrench.conf
has usr/lib/systemd/user/tagwrench.service
has usr/lib/systemd/user/tagwrench-desktop.service
has usr/lib/systemd/user/tagwrench-spnav.service
has usr/share/bash-completion/completions/tagwrench
has usr/share/zsh/vendor-completions/_tagwrench
has usr/share/doc/tagwrench/copyright
has usr/share/doc/tagwrench/changelog.gz
has usr/share/doc/tagwrench/examples/run.env
has usr/share/man/man1/tagwrench.1.gz
# The verbs that the help text names, in the lines behind "Subcommands:".
for verb in $("$program" --help | sed '1,/^Subcommands:/d' | awk '/^  [a-z]/ {print $1}'); do
  has "usr/share/man/man1/tagwrench-$verb.1.gz"
done
! grep -E 'usr/(include|local)|/home/|/build/' <<< "$list" || wrong "these do not belong there"

for package in "$folder"/*.deb; do
  strange=$(dpkg-deb -c "$package" | grep -v -E '^(drwxr-xr-x|-rw-r--r--|-rwxr-xr-x|lrwxrwxrwx) root/root ' || true)
  [ -z "$strange" ] || wrong "$package: $strange"
done

unpacked=$(mktemp -d)
trap 'rm -rf "$unpacked"' EXIT
dpkg-deb -x "$folder"/tagwrench_*.deb "$unpacked"
"$unpacked/usr/bin/tagwrench" --version > /dev/null || wrong "the program does not run"
! readelf -S "$unpacked/usr/bin/tagwrench" | grep -q '\.symtab' || wrong "the program is not stripped"
! readelf -d "$unpacked/usr/bin/tagwrench" | grep -E 'RPATH|RUNPATH' || wrong "the program looks for libraries where it was built"
depends=$(dpkg-deb -f "$folder"/tagwrench_*.deb Depends)
for library in libc6 libopencv-core406 libsystemd0 libhidapi-hidraw0; do
  grep -q "$library" <<< "$depends" || wrong "it does not depend on $library: $depends"
done
dpkg-deb -f "$folder"/tagwrench_*.deb Recommends | grep -q spacenavd || wrong "it does not recommend spacenavd"
dpkg-deb -f "$folder"/libtagwrench-hid-dev_*.deb Depends | grep -q 'libtagwrench-hid0 (= ' || wrong "header and library may differ"

if command -v systemd-analyze > /dev/null; then
  # It looks for the program, so it gets the one of the package.
  mkdir "$unpacked/units"
  for unit in "$unpacked"/usr/lib/systemd/user/*.service; do
    sed "s|ExecStart=tagwrench|ExecStart=$unpacked/usr/bin/tagwrench|" "$unit" > "$unpacked/units/$(basename "$unit")"
  done
  said=$(XDG_RUNTIME_DIR=$unpacked systemd-analyze --user --man=no verify "$unpacked"/units/*.service 2>&1 || echo "status $?")
  [ -z "$said" ] || wrong "systemd-analyze verify: $said"
  sed "s|ExecStart=/usr|ExecStart=$unpacked/usr|" "$unpacked/usr/lib/systemd/system/tagwrench-devices@.service" > "$unpacked/units/tagwrench-devices@.service"
  cp "$unpacked/usr/lib/systemd/system/tagwrench-devices.socket" "$unpacked/units/"
  said=$(systemd-analyze --man=no verify "$unpacked"/units/tagwrench-devices.socket 2>&1 || echo "status $?")
  [ -z "$said" ] || wrong "systemd-analyze verify: $said"
fi
[ "$failed" -eq 0 ] && echo "the packages are as they should be"
exit "$failed"
