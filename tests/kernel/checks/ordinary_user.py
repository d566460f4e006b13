"""An ordinary user of the groups tagwrench and video, our udev rules, that for opening the nodes too, and a real systemd-udevd run the whole of it."""
import os

import rig
from pushes import PUSHES, check_axis, six, wait_for_zero

USER = "1500"  # no such account is needed


def body(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "joydev", "v4l2loopback video_nr=0 exclusive_caps=1")
    daemon = rig.start_spacenavd()
    feeder = setup.feeder(["rest", "push_fx"])
    feeder.tell("loop rest")
    os.chmod("/dev/video0", 0o666)

    for node, output in (("/dev/uhid", "spacemouse"), ("/dev/uhid", "wrench"), ("/dev/uinput", "joystick")):
        refused = setup.bridge(output, user=USER)
        status = refused.wait()
        rig.check(f"without the udev rule {output} ends with status 2 and one line that names {node}",
                  status == 2 and len(refused.err) == 1 and node in refused.err[0], refused.state())

    os.chmod("/dev/video0", 0o600)
    rig.start_udevd(setup.project + "/host/output/70-tagwrench.rules", setup.project + "/host/output/71-tagwrench-direct.rules")
    bridge = setup.bridge("spacemouse", "wrench", "joystick", "jsonl:/tmp/ordinary.jsonl", user=USER)
    rig.check("with the udev rules an ordinary user's bridge runs", bridge.wait_error("rest pose learned"), bridge.state())
    spnav = setup.client("spnav_client", user=USER)
    spnav.wait_line("connected")
    hid = setup.client("hid_client", "256f:c62e", "1209:7a6e", user=USER)
    hid.wait_line("ready")
    rig.check("an ordinary user's hidapi program reads wrenches", hid.wait_line("wrench"))
    sdl = setup.client("sdl_client", "tagwrench joystick", user=USER, env={"SDL_VIDEODRIVER": "dummy"})
    line = sdl.wait_line("joystick")
    rig.check("an ordinary user's game finds the joystick through udev", line.split()[1] == "6", line)
    rig.check_taken(daemon)

    name = "push_fx"
    marks = len(feeder.out), len(spnav.out), len(sdl.out)
    feeder.tell(f"once {name}")
    feeder.wait_line(f"done {name}", marks[0])
    _, (hid_axis, _), (axis, sign) = PUSHES[name]
    rig.check("release is exactly zero", wait_for_zero(spnav, marks[1]), spnav.out[-1:])
    check_axis("libspnav of an ordinary user", name, six(spnav.out[marks[1]:], "motion", 1), axis, sign, 100)
    moved = any(line.startswith("axis ") and line.split()[2] == str(hid_axis) for line in sdl.out[marks[2]:])
    rig.check("SDL of an ordinary user sees the axis move", moved, sdl.state())
    rig.check("SIGTERM ends the bridge with status 0", bridge.stop() == 0, bridge.state())
    rig.check("its devices are gone", rig.wait_until(lambda: not rig.our_devices()), rig.our_devices())


rig.main(body)
