#!/bin/bash
# clean_guest.sh DEB PROGRAMS FRAMES, as root in a guest whose root is a fresh Debian (see setup.sh): installs the package, logs
# an ordinary user in at the first terminal, and expects his pushes to reach a program of libspnav through the unmodified
# spacenavd; removes the package, and expects to find the machine as it was.
set -u
deb=$1 programs=$2 frames=$3
checks=0 failed=0

check() { # WHAT COMMAND...
  local what=$1
  shift
  checks=$((checks + 1))
  if "$@" < /dev/null; then echo "ok - $what"; else failed=$((failed + 1)); echo "FAILED - $what"; fi
}

# What happens in the guest, a line each: the journal, devices that udev has made, what the program of libspnav was told.
exec 8< <(
  journalctl --follow --lines=0 --output=cat &
  udevadm monitor --udev &
  tail --lines=0 --follow=name --retry /home/alice/motion 2> /dev/null &
  wait
)
# Until it succeeds, tried again when something happens, and every five seconds for what nobody announces (a process that has
# ended). The processor may be emulated, so there is much patience.
wait_for() { # COMMAND...
  local end=$((SECONDS + 120))
  until "$@" > /dev/null 2>&1; do
    [ "$SECONDS" -lt "$end" ] || return 1
    if read -r -t 5 -u 8 _; then read -r -N 65536 -t 0.01 -u 8 _; fi # and what has come with it
  done
  return 0 # the loop's own status is that of the last read
}

same() { [ "$1" = "$2" ] || { echo "  is '$1', not '$2'"; return 1; }; }
access() { stat -c '%a %U %G' "$1"; }

# Everything but what lives for a moment, and what a machine writes down about itself.
listing() {
  find / \( -path /proc -o -path /sys -o -path /dev -o -path /run -o -path /host -o -path /tmp -o -path /home -o -path /var/log \
    -o -path /var/tmp -o -path /var/lib/systemd -o -path /var/lib/dpkg -o -path /usr/lib/modules -o -path /var/cache/ldconfig \) \
    -prune -o -printf '%M %U %G %p %l\n' | sort
  dpkg-query -W
  ls /var/lib/dpkg/info
}

at_the_seat() { # COMMAND...: in the session of the user who has logged in there
  setpriv --reuid=alice --regid=alice --init-groups env HOME=/home/alice XDG_RUNTIME_DIR="/run/user/$(id -u alice)" \
    DBUS_SESSION_BUS_ADDRESS="unix:path=/run/user/$(id -u alice)/bus" "$@"
}

log_in() {
  mkdir -p /run/systemd/system/getty@tty1.service.d
  printf '[Service]\nExecStart=\nExecStart=-/sbin/agetty --autologin alice --noclear tty1 linux\n' \
    > /run/systemd/system/getty@tty1.service.d/autologin.conf
  systemctl daemon-reload
  systemctl restart getty@tty1
  wait_for session_is_active
}
session_is_active() { loginctl show-seat seat0 -p ActiveSession | grep -q '=.'; }

# A real camera has its pictures when its node comes; this one when the feeder is there, so udev is made to say it again.
plug_camera_in() {
  modprobe v4l2loopback video_nr=0 exclusive_caps=1
  exec 7> >(exec "$programs/feeder" /dev/video0 GREY 8 "rest=$frames/rest" "push_fx=$frames/push_fx" > /dev/null)
  feeder=$!
  echo "loop rest" >&7
}
camera_taken() {
  said "source: " && return
  udevadm trigger --settle --subsystem-match=video4linux
  said "source: "
}
said() { journalctl -o cat _UID="$(id -u alice)" | grep -q "$1"; }

# A sign of life that came later than the watchdog's limit after the pictures had stopped.
alive_later() {
  [ "$(at_the_seat systemctl --user show -P WatchdogTimestampMonotonic tagwrench)" -gt $((stopped_us + 11000000)) ]
}
started_again() { [ "$(at_the_seat systemctl --user show -P NRestarts tagwrench)" = 1 ] && at_the_seat systemctl --user is-active --quiet tagwrench; }
rests() { tail -n 1 /home/alice/motion | grep -q '^motion [0-9]* 0 0 0 0 0 0$'; }
moves() { grep -q '^motion [0-9]* .*[1-9]' /home/alice/motion; }

explain() {
  systemctl --no-pager --full status spacenavd 2>&1 | tail -n 12
  journalctl --no-pager -o cat _UID="$(id -u alice)" | tail -n 40
  loginctl --no-pager
  tail -n 3 /home/alice/motion
}

useradd --create-home --shell /bin/bash alice
useradd --create-home --shell /bin/bash bob
listing > /tmp/before
uhid_before=$(access /dev/uhid)

check "dpkg installs it" dpkg -i "$deb"
check "the rule gives /dev/uhid to the service's user and to nobody else" same "$(access /dev/uhid)" "600 tagwrench root"
check "the module of uinput is loaded, and its node has the rule" same "$(access /dev/uinput)" "600 tagwrench root"
check "systemd listens for who wants devices" systemctl is-active --quiet tagwrench-devices.socket
check "and will after the next start" systemctl is-enabled --quiet tagwrench-devices.socket
check "nothing is enabled for everybody" same "$(find /etc/systemd/user -name 'tagwrench*')" ""
has_devices() { setpriv --reuid="$1" --regid="$1" --init-groups tagwrench doctor 2> /dev/null | grep -q '^ok.*/dev/uhid'; }
check "nobody has devices made who is not at the seat" eval '! has_devices alice'
check "and is told who may" eval 'setpriv --reuid=alice --regid=alice --init-groups tagwrench doctor | grep -q "usermod -aG tagwrench"'
check "an ordinary user logs in at the first terminal" log_in
check "he is of no group but his own" same "$(id -Gn alice)" alice
check "the seat lets him have devices made" wait_for has_devices alice
check "without letting him type" bash -c '! setpriv --reuid=alice --regid=alice --init-groups test -w /dev/uhid -o -w /dev/uinput'
check "and nobody else" eval '! has_devices bob'
usermod -aG tagwrench bob
check "but a member of the group, who may not type either" eval 'has_devices bob && ! setpriv --reuid=bob --regid=bob --init-groups test -w /dev/uhid -o -w /dev/uinput'

wait_for at_the_seat systemctl --user is-active default.target
check "he enables the service; without a camera it waits" at_the_seat systemctl --user enable --now --quiet tagwrench
check "and says so" eval 'at_the_seat systemctl --user show -p StatusText tagwrench | grep -q "waiting for a camera"'
check "and makes no device" same "$(ls /sys/class/hidraw 2>/dev/null)" ""

check "the socket's daemon runs beside it" at_the_seat systemctl --user is-active --quiet tagwrench-spnav

install -d -o alice -g alice /home/alice/.config /home/alice/.config/tagwrench
install -o alice -g alice "$frames/rest/sensor.yaml" /home/alice/.config/tagwrench/
printf 'OUTPUTS=--output spacemouse --output wrench\nOPTIONS=--profile cad\n' > /home/alice/.config/tagwrench/run.env
check "it starts with options of his" at_the_seat systemctl --user restart tagwrench
plug_camera_in
check "it takes the camera that is plugged in, by his sensor.yaml" wait_for camera_taken
check "it makes what he asked for" wait_for test -e /dev/hidraw1
mapfile -t lenders < <(grep -lx tagwrench-devic /proc/[0-9]*/comm)
check "by a process of the service's for each device" same "$(stat -c %U "${lenders[@]}" | xargs)" "tagwrench tagwrench"
# shellcheck disable=SC2016  # awk's
check "which has no capabilities" awk '/^Cap(Prm|Eff|Bnd)/ {bad += $2 !~ /^0*$/} END {exit bad}' "${lenders[0]%comm}status"
install -m 755 "$programs/spnav_client" /tmp/ # the project may lie where only its owner can go
at_the_seat /tmp/spnav_client > /home/alice/motion 2>&1 &
wait_for grep -q connected /home/alice/motion
check "the rest pose is learned" wait_for said "rest pose learned"
echo "once push_fx" >&7
check "a push reaches a program through spacenavd, without root" wait_for moves
check "and its end" wait_for rests
check "the seat gives him the wrench sensor" wait_for at_the_seat test -r /dev/hidraw0 -a -r /dev/hidraw1
service=$(at_the_seat systemctl --user show -P MainPID tagwrench)
check "the service can write no file of his" grep -q '^[0-9]* [0-9]* [0-9]*:[0-9]* / / ro' "/proc/$service/mountinfo"
# shellcheck disable=SC2016  # awk's
check "it gets no privileges, and system calls of its kind only" awk '/^NoNewPrivs:/ {n = $2} /^Seccomp:/ {s = $2} END {exit !(n == 1 && s == 2)}' "/proc/$service/status"
kill -STOP "$feeder"
stopped_us=$(awk '{printf "%d", $1 * 1e6}' /proc/uptime)
check "with a camera that gives no pictures it lives on" wait_for alive_later
kill -CONT "$feeder"
check "the service was never started again" same "$(at_the_seat systemctl --user show -P NRestarts tagwrench)" 0

kill -STOP "$service"
check "a loop that hangs is noticed, killed and started again" wait_for started_again
check "and makes the devices again" wait_for test -e /dev/hidraw1
[ "$failed" -eq 0 ] || explain

check "dpkg removes it while it runs" dpkg -r tagwrench
check "nothing of it runs" wait_for bash -c '! cat /proc/[0-9]*/comm | grep -E "^(tagwrench|tw-)"'
check "its devices are gone" wait_for bash -c '! ls /sys/class/hidraw/hidraw0'
check "nobody listens" bash -c '! ls /run/tagwrench-devices/uhid'
check "what it gave is taken back" same "$(access /dev/uhid)" "$uhid_before"
check "also from the user at the seat" bash -c '! setpriv --reuid=alice --regid=alice --init-groups test -w /dev/uhid'
check "dpkg purges it" dpkg -P tagwrench
listing > /tmp/after
check "the machine is as it was" diff /tmp/before /tmp/after

echo "$((checks - failed)) of $checks ok"
[ "$failed" -eq 0 ]
