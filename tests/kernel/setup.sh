#!/bin/bash
# setup.sh DIR: makes in DIR what the kernel tests boot: a Debian kernel, an initramfs and the modules that the tests
# load. Nothing is installed: packages are downloaded and unpacked, so an ordinary user can run it. A second call
# finds DIR/ready and returns at once. Exit status 1 with one line (also in DIR/unavailable) where it cannot be done.
set -u
here=$(dirname "$(readlink -f "$0")")
[ $# -eq 1 ] || { echo "usage: setup.sh DIR" >&2; exit 2; }
mkdir -p "$1" && dir=$(readlink -f "$1") || exit 1
export PATH=$PATH:/usr/sbin:/sbin LC_ALL=C

# What the guests load. Their dependencies come along.
guest_modules="uinput uhid hid-generic evdev joydev vivid videobuf2-v4l2 videobuf2-vmalloc xhci-pci ftdi_sio dummy_hcd libcomposite usb_f_hid usbhid"
initramfs_modules="virtio_pci virtio_console 9pnet_virtio 9p overlay"

unavailable() {
  echo "kernel tests unavailable: $1" | tee "$dir/unavailable" >&2
  exit 1
}

exec 9>"$dir/lock"
flock 9
recipe=$(cat "$here/setup.sh" "$here"/rig/* | sha256sum | cut -d' ' -f1)
[ "$(cat "$dir/ready" 2>/dev/null)" = "$recipe" ] && exit 0
rm -f "$dir/ready" "$dir/accelerator" "$dir/unavailable"

[ "$(uname -m)" = x86_64 ] || unavailable "the guest is x86-64 and this machine is $(uname -m)"
missing=
for need in qemu-system-x86_64:qemu-system-x86 busybox:busybox-static depmod:kmod cpio:cpio xz:xz-utils \
    python3:python3 make:make gcc:gcc dpkg-deb:dpkg apt-get:apt flock:util-linux; do
  command -v "${need%%:*}" >/dev/null || missing="$missing ${need#*:}"
done
[ -z "$missing" ] || unavailable "install the Debian packages$missing"

work=$dir/work
rm -rf "$work"
mkdir -p "$work/deb" "$work/image" "$work/headers" "$work/loopback" "$work/initramfs" || exit 1
trap 'rm -rf "$work"' EXIT
log=$dir/setup.log
: > "$log"
cd "$work/deb" || exit 1

apt_options=()
current() { apt-cache "${apt_options[@]}" depends "$1" 2>>"$log" | sed -n "s/^ *Depends: \($2.*\)/\1/p" | head -n 1; }

# The archive keeps only the newest point release, so its name is asked for every time.
fetch() {
  local image headers common kbuild
  image=$(current linux-image-amd64 linux-image-)
  headers=$(current linux-headers-amd64 linux-headers-)
  [ -n "$image" ] && [ -n "$headers" ] || return 1
  [ "${image#linux-image-}" = "${headers#linux-headers-}" ] || return 1
  common=$(current "$headers" linux-headers-)
  kbuild=$(current "$headers" linux-kbuild-)
  release=${image#linux-image-}
  rm -f ./*.deb
  apt-get "${apt_options[@]}" -o APT::Sandbox::User=root download "$image-unsigned" "$headers" "$common" "$kbuild" \
    v4l2loopback-dkms >>"$log" 2>&1
}

# Package lists of our own when the machine's are absent or stale: updating those takes root.
private_lists() {
  mkdir -p "$work/apt/lists/partial" "$work/apt/cache/archives/partial"
  apt_options=(-o "Dir::State::Lists=$work/apt/lists" -o "Dir::Cache=$work/apt/cache" -o "APT::Sandbox::User=root")
  apt-get "${apt_options[@]}" update >>"$log" 2>&1
}

release=
fetch || { private_lists; fetch; } ||
  unavailable "cannot download linux-image-amd64's kernel, its headers and v4l2loopback-dkms with apt-get (see $log)"

for deb in linux-headers-*.deb linux-kbuild-*.deb; do
  dpkg-deb -x "$deb" "$work/headers" || unavailable "cannot unpack $deb"
done
dpkg-deb -x v4l2loopback-dkms_*.deb "$work/loopback" || unavailable "cannot unpack v4l2loopback-dkms"
dpkg-deb -x linux-image-*.deb "$work/image" || unavailable "cannot unpack linux-image"

headers=$work/headers/usr/src/linux-headers-$release
sed -i "s|/usr/src/|$work/headers/usr/src/|" "$headers/Makefile"  # the one absolute path in them
source=$(echo "$work"/loopback/usr/src/v4l2loopback-*)
make -C "$headers" M="$source" modules >>"$log" 2>&1 && strip --strip-debug "$source/v4l2loopback.ko" ||
  unavailable "v4l2loopback does not build for $release (see $log)"
install -D "$source/v4l2loopback.ko" "$work/image/lib/modules/$release/updates/v4l2loopback.ko"
depmod -b "$work/image" "$release" 2>>"$log" || unavailable "depmod failed for $release (see $log)"

# The .ko files of the modules in $1 and what they need, in loading order.
closure() {
  local module
  for module in $1; do
    modprobe -d "$work/image" -S "$release" --show-depends "$module" 2>>"$log" || echo "absent $module"
  done | awk '$1 == "insmod" && !seen[$2]++ {print $2} $1 == "absent" {print "absent:" $2}'
}

keep=$work/keep/lib/modules/$release
mkdir -p "$keep"
for file in $(closure "$guest_modules v4l2loopback"); do
  [ "${file#absent:}" = "$file" ] || unavailable "kernel $release has no module ${file#absent:}"
  cp "$file" "$keep/"
done
cp "$work/image/lib/modules/$release"/modules.builtin* "$work/image/lib/modules/$release"/modules.order "$keep/"
depmod -b "$work/keep" "$release" 2>>"$log" || unavailable "depmod failed for $release (see $log)"

tree=$work/initramfs
mkdir -p "$tree"/{bin,proc,sys,dev,modules,lower,upper,root}
for file in $(closure "$initramfs_modules"); do
  [ "${file#absent:}" = "$file" ] || unavailable "kernel $release has no module ${file#absent:}"
  cp "$file" "$tree/modules/"
  basename "$file" >> "$tree/modules/order"
done
cp "$(command -v busybox)" "$tree/bin/busybox"
! ldd "$tree/bin/busybox" >/dev/null 2>&1 || unavailable "busybox is not static: install busybox-static"
install -m 755 "$here/rig/init" "$tree/init"
install -m 755 "$here/rig/init_root" "$tree/init_root"
# Not compressed: unpacking takes seconds where the processor is emulated. The same goes for the kernel.
(cd "$tree" && find . | cpio -o -H newc --quiet --owner 0:0) > "$work/initramfs.img" || exit 1
python3 "$here/rig/extract_vmlinux.py" "$work/image/boot/vmlinuz-$release" "$work/vmlinux" 2>>"$log" ||
  unavailable "no kernel image inside vmlinuz-$release (see $log)"

rm -rf "${dir:?}/lib"
mv "$work/keep/lib" "$work/vmlinux" "$work/initramfs.img" "$dir/"

# Boot once: proves the rig, and tells whether KVM is worth having (nested inside some hypervisors it is far slower than
# emulation, so opening /dev/kvm proves nothing). Where it works a boot takes two seconds.
boots() {
  echo "$1" > "$dir/accelerator"
  "$here/vm" -t "$2" "$dir" true >>"$log" 2>&1
}
{ [ -w /dev/kvm ] && boots kvm 8; } || boots tcg,thread=multi,tb-size=256 120 || {
  rm -f "$dir/accelerator"
  unavailable "the guest does not boot (see $log)"
}
echo "$recipe" > "$dir/ready"
