"""A vendor and product id of our own: with the line that the bridge prints, spacenavd takes the device as it is."""
import re

import rig
from pushes import PUSHES, check_axis, six, wait_for_zero

SENSOR = "/run/own_id.yaml"


def body(setup):
    rig.load("uhid", "hid-generic", "evdev", "v4l2loopback video_nr=0 exclusive_caps=1")
    with open(setup.clip("rest") + "/sensor.yaml", encoding="utf-8") as file:
        text = file.read()
    with open(SENSOR, "w", encoding="utf-8") as file:
        file.write(text + "\nspacemouse: {id: \"1209:7a70\"}\n")
    pushes = ("push_fx", "push_fy", "push_mz")
    feeder = setup.feeder(["rest", *pushes])
    feeder.tell("loop rest")
    bridge = setup.bridge("spacemouse", sensor=SENSOR)
    told = bridge.wait_error("device-id") or ""
    line = re.search(r"device-id = 1209:7a70", told)
    rig.check("the bridge prints the line for /etc/spnavrc", line, told or bridge.state())
    rig.check("the bridge learns the rest pose", bridge.wait_error("rest pose learned"), bridge.state())

    daemon = rig.start_spacenavd(line.group(0) + "\n" if line else "")
    spnav = setup.client("spnav_client")
    spnav.wait_line("connected")
    rig.check_taken(daemon)
    for name in pushes:
        _, _, (axis, sign) = PUSHES[name]
        marks = len(feeder.out), len(spnav.out)
        feeder.tell(f"once {name}")
        feeder.wait_line(f"done {name}", marks[0])
        rig.check(f"{name}: release is exactly zero", wait_for_zero(spnav, marks[1]), spnav.out[-1:])
        check_axis("libspnav", name, six(spnav.out[marks[1]:], "motion", 1), axis, sign, 100)
        feeder.tell("loop rest")
    rig.check("Ctrl-C ends the bridge with status 0", bridge.stop(rig.signal.SIGINT) == 0, bridge.state())


rig.main(body)
