"""The desktop around the devices: evdev, joydev, udev's classes and libinput (the pointer must not move); spacenavd started
late, and another SpaceMouse beside ours; programs that never read, and programs that write nonsense."""
import fcntl
import json
import os
import random
import select
import shutil

import nodes
import rig
from pushes import PUSHES, check_axis, six, wait_for_zero

JSONL = "/run/other_readers.jsonl"
PUCK, STICK = "tagwrench SpaceMouse", "tagwrench joystick"
PUCK_ID = "0003:0000256F:0000C62E"
POINTERS = ("ID_INPUT_MOUSE", "ID_INPUT_TOUCHPAD", "ID_INPUT_POINTINGSTICK", "ID_INPUT_TABLET", "ID_INPUT_KEYBOARD",
            "ID_INPUT_ACCELEROMETER")
HIDIOCSFEATURE_64 = 0xC0404806


def check_axes(name, limit, buttons):
    path = nodes.event_node(name)
    rig.check(f"{name} has an evdev node", path, rig.input_devices("tagwrench"))
    fd = os.open(path, os.O_RDONLY)
    ranges = {nodes.ABS_NAMES[code] if code < 6 else code: nodes.absolute(fd, code)[1:3]
              for code in nodes.bits(fd, nodes.EV_ABS, 8)}
    rig.check(f"{name}: six absolute axes, X to RZ, of +-{limit}",
              ranges == dict.fromkeys(nodes.ABS_NAMES, (-limit, limit)), ranges)
    keys = nodes.bits(fd, nodes.EV_KEY)
    rig.check(f"{name}: {buttons} buttons, none of them a mouse's; no relative axis",
              len(keys) == buttons and not any(0x110 <= key < 0x120 for key in keys)
              and nodes.EV_REL not in nodes.bits(fd, 0, 4), (keys, nodes.bits(fd, 0, 4)))
    os.close(fd)
    return path


def check_class(path, name):
    rig.run("udevadm", "settle", "-t", "60")
    _, out, err = rig.run("udevadm", "info", "--query=property", path)
    properties = dict(line.split("=", 1) for line in out.splitlines())
    taken_for = [key for key in POINTERS if properties.get(key) == "1"]
    rig.check(f"udev takes {name} for a joystick and for nothing else",
              properties.get("ID_INPUT_JOYSTICK") == "1" and not taken_for, out + err)


def watch_pointer(setup):
    """libinput as a desktop runs it, and a mouse that proves it watches; None where it is not installed."""
    if shutil.which("libinput") is None:
        print("     skipped - libinput: install libinput-tools")
        return None
    mouse = rig.Program("mouse", ["python3", "-B", f"{setup.project}/tests/kernel/guest/mouse.py"])
    mouse.wait_line("ready")
    watcher = rig.Program("libinput", ["stdbuf", "-oL", "libinput", "debug-events"])
    seen = rig.wait_until(lambda: any("a mouse" in line for line in watcher.out))
    rig.check("libinput sees a mouse", seen, watcher.state())
    mouse.tell("move")
    moved = rig.wait_until(lambda: any("POINTER_MOTION" in line for line in watcher.out))
    rig.check("libinput tells its motion", moved, watcher.state())
    return watcher


def check_pointer(watcher, since):
    events = [line for line in watcher.out[since:] if "tagwrench" in line or "POINTER" in line or "KEYBOARD" in line]
    rig.check("libinput: the puck moves no pointer, presses no key and is no device of the desktop",
              watcher.running() and not events, events[:5])


def push(feeder, name):
    mark = len(feeder.out)
    feeder.tell(f"once {name}")
    feeder.wait_line(f"done {name}", mark)
    feeder.tell("loop rest")


def came_to_rest(reader, since):
    def last():
        values = dict(reader.axes(since))
        return values and not any(values.values())
    return rig.wait_until(last)


def check_pushes(feeder, readers):
    """A push along two axes; each plain reader sees it on its own axis, and the return."""
    for name in ("push_fx", "push_mz"):
        _, (axis, sign), _ = PUSHES[name]
        marks = [len(reader.records) for _, reader, _ in readers]
        push(feeder, name)
        for (who, reader, strong), mark in zip(readers, marks):
            back = came_to_rest(reader, mark)
            far = max(reader.axes(mark), key=lambda event: abs(event[1]), default=None)
            rig.check(f"{who}: {name} is on axis {axis}, sign {sign:+d}, and goes back to zero",
                      far and far[0] == axis and far[1] * sign >= strong and back, f"{far}, last {reader.axes(mark)[-6:]}")


def samples():
    with open(JSONL, encoding="utf-8") as file:
        return [json.loads(line) for line in file.read().split("\n")[:-1]]


def goes_on(bridge):
    before = len(samples())
    return rig.wait_until(lambda: not bridge.running() or len(samples()) >= before + 8) and bridge.running()


def check_nonsense(bridge):
    """Output and feature reports of every id and size, none of them the LED's two bytes."""
    chance = random.Random(1)
    told = len(bridge.err)
    for identity in (PUCK_ID, "0003:00001209:00007A6E"):
        fd = os.open(nodes.hidraw_node(identity), os.O_RDWR)
        for size in (1, 2, 3, 7, 13, 64):
            for report in (0, 1, 2, 3, 5, 0x20, 0xFF):
                data = bytes([report]) + chance.randbytes(size - 1)
                try:
                    os.write(fd, data)
                    fcntl.ioctl(fd, HIDIOCSFEATURE_64, data.ljust(64, b"\0"))
                except OSError:
                    pass  # the kernel may refuse it
        os.close(fd)
    rig.check("nonsense in output and feature reports: the bridge goes on and says nothing",
              goes_on(bridge) and len(bridge.err) == told, bridge.state())
    fd = os.open(nodes.hidraw_node(PUCK_ID), os.O_RDWR)
    os.write(fd, bytes([4, 1]))
    rig.check("and the LED still obeys", bridge.wait_error("LED on", told, patience=20), bridge.state())
    os.close(fd)


class NeverReads:
    """Has every node of ours open and reads none of them."""

    def __init__(self):
        self.hidraw = os.open(nodes.hidraw_node(PUCK_ID), os.O_RDWR | os.O_NONBLOCK)
        self.others = [os.open(path, os.O_RDONLY | os.O_NONBLOCK)
                       for path in (nodes.hidraw_node("0003:00001209:00007A6E"), nodes.event_node(PUCK), nodes.event_node(STICK))]

    def check(self, bridge):
        rig.check("a program that never reads holds nothing up", goes_on(bridge), bridge.state())
        lost = sum(sample["dropped"] for sample in samples()[-20:])
        print(f"     {len(samples())} samples, {lost} frames dropped among the last 20")
        waiting = 0
        while select.select([self.hidraw], [], [], 0)[0]:
            os.read(self.hidraw, 64)
            waiting += 1
        rig.check("what waits for it in the kernel is bounded: 64 reports of hidraw", waiting <= 64, waiting)
        newest = select.select([self.hidraw], [], [], rig.PATIENCE)[0] and os.read(self.hidraw, 64)
        rig.check("after them comes what is: zero", newest and not any(newest[1:13]), newest)


def check_late_spacenavd(feeder, setup):
    daemon = rig.start_spacenavd()
    rig.check_taken(daemon)
    spnav = setup.client("spnav_client")
    spnav.wait_line("connected")
    check_ours(feeder, spnav, "started after the bridge")
    return spnav


def check_ours(feeder, spnav, when):
    _, _, (axis, sign) = PUSHES["push_fx"]
    mark = len(spnav.out)
    push(feeder, "push_fx")
    rig.check(f"spacenavd {when}: release is exactly zero", wait_for_zero(spnav, mark), spnav.out[-2:])
    check_axis(f"libspnav, spacenavd {when},", "push_fx", six(spnav.out[mark:], "motion", 1), axis, sign, 100)


def check_other_puck(setup, feeder, bridge, spnav):
    other = rig.Program("other_puck", ["python3", "-B", f"{setup.project}/tests/kernel/guest/other_puck.py"])
    other.wait_line("ready")
    name = "3Dconnexion SpaceMouse Compact"
    listed = rig.wait_until(lambda: nodes.event_node(name) and rig.run(setup.tagwrench, "read", "--list")[1])
    lines = [line for line in (listed or "").splitlines() if line.startswith("6-dof")]
    rig.check("read --list shows both pucks, with their layouts",
              len(lines) == 2 and any("256f:c62e" in line and "combined" in line for line in lines)
              and any("256f:c635" in line and "split" in line for line in lines), listed)

    mark = len(spnav.out)
    counts = [0]

    def newcomer_speaks():
        counts[0] = 120 if counts[0] != 120 else 140
        other.tell(f"move {counts[0]} 0 0 0 0 0")
        return any(event[0] in (171, 200) for event in six(spnav.out[mark:], "motion", 1))
    rig.check("spacenavd shows programs the newcomer", rig.wait_until(newcomer_speaks), spnav.out[-3:])
    other.tell("move 0 0 0 0 0 0")
    rig.wait_until(lambda: (six(spnav.out[mark:], "motion", 1) or [[1]])[-1] == [0.0] * 6)
    own, mark = nodes.Evdev(nodes.event_node(STICK)), len(spnav.out)
    push(feeder, "push_fx")
    rig.check("ours goes on for everybody else", came_to_rest(own, 0) and max(v for _, v in own.axes()) > 6000, own.axes()[-3:])
    heard = [event for event in six(spnav.out[mark:], "motion", 1) if any(event)]
    print(f"     with two pucks spacenavd gives programs the one that came last: {len(heard)} events of ours")
    rig.check("but not for spacenavd's programs, which have the newcomer alone", not heard, heard[:3])

    other.stop()
    rig.wait_until(lambda: nodes.event_node(name) is None)
    check_ours(feeder, spnav, "with the newcomer unplugged")
    rig.check("the bridge did not mind", bridge.running() and goes_on(bridge), bridge.state())


def body(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "joydev", "v4l2loopback video_nr=0 exclusive_caps=1")
    rig.start_udevd(setup.project + "/host/output/70-tagwrench.rules")
    watcher = watch_pointer(setup)
    since = len(watcher.out) if watcher else 0
    feeder = setup.feeder(["rest", "push_fx", "push_mz"])
    feeder.tell("loop rest")
    bridge = setup.bridge("spacemouse", "wrench", "joystick", f"jsonl:{JSONL}")
    rig.check("without spacenavd the bridge runs", bridge.wait_error("rest pose learned"), bridge.state())
    paths = check_axes(PUCK, 350, 2), check_axes(STICK, 32767, 8)
    for path, name in zip(paths, (PUCK, STICK)):
        check_class(path, name)
    never = NeverReads()
    check_nonsense(bridge)

    joystick = nodes.Joydev(nodes.joystick_node(STICK))
    rig.check("joydev: six axes, eight buttons, all of them told at the start",
              joystick.count(0x11) == 6 and joystick.count(0x12) == 8
              and rig.wait_until(lambda: len(joystick.initial()) == 14), joystick.records)
    readers = [("evdev, SpaceMouse", nodes.Evdev(paths[0]), 70), ("evdev, joystick", nodes.Evdev(paths[1]), 6000),
               ("joydev", joystick, 6000)]
    check_pushes(feeder, readers)
    if watcher:
        check_pointer(watcher, since)
    never.check(bridge)
    spnav = check_late_spacenavd(feeder, setup)
    check_other_puck(setup, feeder, bridge, spnav)
    rig.check("Ctrl-C ends the bridge with status 0", bridge.stop(rig.signal.SIGINT) == 0, bridge.state())


rig.main(body)
