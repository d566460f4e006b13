"""The board on a real USB serial driver: found by its stable path and by its USB identity, refused to an ordinary user,
pulled out in the middle of a stream and plugged in again, and lit for a camera. Its image runs on the emulated board outside of the guest."""
import csv
import glob
import json
import os

import rig

USER = "1500"
IDENTITY = "usb:0403:6001"
REFERENCE = "/run/reference.csv"


def wish(what):
    """Of the hand outside, tests/kernel/rig/usb_plug.py."""
    with open(f"/run/rig/{what}", "w", encoding="utf-8") as file:
        file.write("please\n")


def cells(lines):
    return [sample for sample in map(json.loads, lines) if sample["kind"] == "cell"]


def whole_rows():
    if not os.path.exists(REFERENCE):
        return 0
    with open(REFERENCE, encoding="utf-8") as file:
        whole_lines = file.read().split("\n")[:-1]  # the bridge may be in the middle of one
    rows = list(csv.DictReader(whole_lines)) if whole_lines else []
    return sum(all(row.get(f"cell{i}_counts") for i in range(4)) for row in rows)


def body(setup):
    rig.load("xhci-pci", "ftdi_sio", "uhid", "hid-generic", "evdev", "v4l2loopback video_nr=0 exclusive_caps=1")
    rig.start_udevd(setup.project + "/host/output/70-tagwrench.rules")
    ports = rig.wait_until(lambda: glob.glob("/dev/serial/by-id/*"))
    rig.check("the serial driver and udev make a stable path", ports, os.listdir("/dev"))
    port = ports[0]

    status, out, err = rig.run(setup.tagwrench, "board", "info", "--port", port, patience=60)
    rig.check("board info prints the board's identity", status == 0 and "atmega328p" in out, out + err)
    status, out, err = rig.run(setup.tagwrench, "board", "info", "--port", IDENTITY, patience=60)
    rig.check("it is found by its USB identity", status == 0 and "atmega328p" in out, out + err)
    status, out, err = rig.run(setup.tagwrench, "board", "info", patience=60)
    rig.check("the only port needs no name", status == 0 and "atmega328p" in out, out + err)
    status, _, err = rig.run(*rig.as_user(USER), setup.tagwrench, "board", "info", "--port", port, patience=60,
                             env={"HOME": "/tmp", "PATH": os.environ["PATH"]})
    rig.check("without permission one line names the group",
              status == 2 and "dialout" in err and err.count("\n") == 1, err)

    watch = rig.Program("watch", [setup.tagwrench, "board", "watch", "--port", port, "--json"])
    watch.wait_line("{", patience=60)
    second, _, err = rig.run(setup.tagwrench, "board", "info", "--port", port, patience=60)
    rig.check("a second host is told that the port is taken", second == 2 and err.count("\n") == 1, err)
    wish("usb-unplug")
    rig.check("an unplugged board is said to be gone", watch.wait_error("the port is gone"), watch.state())
    rig.check("and its device node goes", rig.wait_until(lambda: not os.path.exists(port)), port)
    seen = len(watch.out)
    wish("usb-plug")
    watch.wait_line("{", since=seen, patience=60)
    rig.check("plugged in again it goes on by itself", watch.running(), watch.state())
    rig.wait_until(lambda: len({s["channel"] for s in cells(watch.out[seen:])}) == 4)
    channels = sorted({sample["channel"] for sample in cells(watch.out[seen:])})
    rig.check("with all four load cells", channels == [0, 1, 2, 3], channels)
    def times_of_the_first():
        return [sample["t_ns"] for sample in cells(watch.out) if sample["channel"] == 0]
    rig.wait_until(lambda: len(times_of_the_first()) > 100, patience=60)
    times = times_of_the_first()
    backwards = [(a, b) for a, b in zip(times, times[1:]) if a >= b]
    rig.check("time stamps go on growing", len(times) > 100 and not backwards, backwards[:3])
    rig.check("Ctrl-C ends it with status 0", watch.stop(rig.signal.SIGINT) == 0, watch.state())

    feeder = setup.feeder(["rest"])
    feeder.tell("loop rest")
    bridge = setup.bridge(f"reference:{REFERENCE}", more=["--board", port])
    rig.check("a run settles the light with a camera and the board", bridge.wait_error("light: LED", patience=90),
              bridge.state())
    rig.check("and writes frames beside all four load cells", rig.wait_until(lambda: whole_rows() >= 10, patience=90),
              bridge.state())
    rig.check("Ctrl-C ends the run with status 0", bridge.stop(rig.signal.SIGINT) == 0, bridge.state())


rig.main(body)
