"""A USB device of another computer: the gadget side and the other computer's side of one dummy_hcd. What spacenavd, plain libusb
and hidapi over libusb get, and what becomes of it when bridge, cable, controller or the other computer's attention go."""
import json
import os
import signal
import struct
import time

import rig
from pushes import PUSHES, check_axis, six, wait_for_zero

CONTROLLER = "dummy_udc.0"
PORT_OFF = "/sys/bus/usb/devices/usb1/1-0:1.0/usb1-port1/disable"  # of the other computer: as good as its cable
CONFIGFS = "/sys/kernel/config"
GADGETS = f"{CONFIGFS}/usb_gadget"
OURS = f"{GADGETS}/tagwrench-sensor"
FOREIGN = f"{GADGETS}/g1"
JSONL = "/run/gadget.jsonl"
MOTION, BUTTONS = 1, 3


def put(path, text):
    with open(path, "w", encoding="utf-8") as file:
        file.write(text + "\n")


def gadget(setup, *arguments):
    return rig.run(setup.tagwrench, "gadget", *arguments)


def reports(client, since=0):
    """(arrival ns, bytes) of every report that a client has printed."""
    lines = [line.split() for line in client.out[since:] if line.startswith("in ")]
    return [(int(words[1]), bytes.fromhex(words[2])) for words in lines if len(words) == 3]


def motions(client, since=0):
    return [list(struct.unpack("<6h", report[1:])) for _, report in reports(client, since)
            if report[0] == MOTION and len(report) == 13]


def wait_motion(client, moving, since):
    """Until the newest motion is one, or is exactly none."""
    def there():
        seen = motions(client, since)
        return seen and any(seen[-1]) == moving
    return rig.wait_until(there)


def tell(client, command):
    mark = len(client.out)
    client.tell(command)
    client.wait_line(f"did {command}", mark)


def half_made():
    """What a crash in the middle leaves: a function in a configuration, and no controller."""
    os.makedirs(f"{OURS}/strings/0x409")
    os.mkdir(f"{OURS}/functions/hid.wrench")
    os.makedirs(f"{OURS}/configs/c.1/strings/0x409")
    os.symlink(f"{OURS}/functions/hid.wrench", f"{OURS}/configs/c.1/hid.wrench")


def check_before(setup):
    """Errors, and a start on what is left over."""
    status, _, err = gadget(setup, "up")
    rig.check("without a controller `gadget up` ends with status 2 and one line that names boards and dtoverlay",
              status == 2 and "dtoverlay=dwc2" in err and err.count("\n") == 1, err)
    rig.load("dummy_hcd", "libcomposite")
    rig.run("mount", "-t", "configfs", "none", CONFIGFS)
    os.makedirs(FOREIGN)
    put(f"{FOREIGN}/idVendor", "0x1d6b")
    half_made()
    status, _, err = gadget(setup, "up")
    rig.check("`gadget up` works over what a crash has left", status == 0 and CONTROLLER in err, err)
    rig.check("and leaves the other face's function there no more", os.listdir(f"{OURS}/functions") == ["hid.spacemouse"],
              os.listdir(f"{OURS}/functions"))
    rig.check("a gadget of somebody else is as it was", open(f"{FOREIGN}/idVendor", encoding="utf-8").read() == "0x1d6b\n"
              and open(f"{FOREIGN}/UDC", encoding="utf-8").read() == "\n")
    mode = rig.wait_until(lambda: os.path.exists("/dev/hidg0") and os.stat("/dev/hidg0").st_mode & 0o777 == 0o660)
    rig.check("our udev rule lets group tagwrench write to the node", mode)


def bridge_on(setup, feeder, *more):
    """A bridge on the gadget, with a push held."""
    feeder.tell("loop rest")
    bridge = setup.bridge("gadget", *more)
    rig.check("the bridge learns the rest pose", bridge.wait_error("rest pose learned"), bridge.state())
    return bridge


def check_spacenavd(setup, feeder):
    daemon = rig.start_spacenavd()
    bridge = bridge_on(setup, feeder)
    rig.check("the bridge says that the other computer takes reports", bridge.wait_error("takes reports"), bridge.state())
    rig.check_taken(daemon)
    spnav = setup.client("spnav_client")
    spnav.wait_line("connected")
    rig.check("the LED that spacenavd lights arrives", bridge.wait_error("LED on"), bridge.state())
    mark = len(spnav.out)
    feeder.tell("hold held_fz")
    if not rig.wait_until(lambda: any(map(any, six(spnav.out[mark:], "motion", 1)))):
        raise rig.GaveUp(f"spacenavd on the other computer sees no push: {spnav.out[-3:]}")
    mark = len(spnav.out)
    rig.wait_until(lambda: len(six(spnav.out[mark:], "motion", 1)) > 5)
    check_axis("spacenavd on the other computer", "push_fz", six(spnav.out[mark:], "motion", 1), *PUSHES["push_fz"][2], 100)
    mark = len(spnav.out)
    os.kill(bridge.pid, signal.SIGKILL)
    bridge.wait()
    rig.check("kill -9 of the bridge: the other computer's puck is at rest", wait_for_zero(spnav, mark), spnav.out[-2:])
    left = rig.wait_until(lambda: not rig.processes("tw-"))
    rig.check("and no process is left behind", left, rig.processes("tw-"))
    spnav.stop()
    daemon.stop()


def check_asleep(feeder, client):
    """A computer that does not ask for a while gets what the controller and the kernel hold, one report each, and then what
    is."""
    mark = len(client.out)
    feeder.tell("hold held_fz")
    rig.check("plain libusb sees the push", wait_motion(client, True, mark), client.out[-3:])
    tell(client, "hold")
    feeder.tell("loop rest")
    frames = len(feeder.out)
    rig.wait_until(lambda: len(feeder.out) > frames + 8)
    mark = len(client.out)
    tell(client, "go")
    rig.check("after its sleep it is told of the release", wait_motion(client, False, mark), client.out[-3:])
    old = [m for m in motions(client, mark) if any(m)]
    print(f"     reports of before its sleep: {len(old)}")
    rig.check("and of two older reports at most", len(old) <= 2, old)


def check_output_reports(bridge, client):
    for state, word in (("1", "LED on"), ("0", "LED off")):
        mark = len(bridge.err)
        tell(client, f"led {state}")
        rig.check(f"{word} by a control transfer arrives", bridge.wait_error(word, mark), bridge.state())
    tell(client, "nonsense")
    mark = len(client.out)
    rig.check("output reports that are nonsense change nothing", wait_motion(client, False, mark) and bridge.running(),
              bridge.state())


def check_gone_and_back(what, bridge, feeder, client, go, back, word, goes_at_rest=False):
    """Off in the middle of a push, back after the release and on with a push."""
    mark, errors = len(client.out), len(bridge.err)
    feeder.tell("hold held_fz")
    rig.check(f"{what}: a push before", wait_motion(client, True, mark), client.out[-3:])
    mark = len(client.out)
    go()
    client.wait_line("lost", mark)
    if goes_at_rest:
        rig.check("taken down in the middle of a push, it goes at rest", motions(client)[-1] == [0] * 6, client.out[-3:])
    rig.check(f"{what}: the bridge says so", bridge.wait_error(word, errors), bridge.state())
    feeder.tell("loop rest")
    frames = len(feeder.out)
    rig.wait_until(lambda: len(feeder.out) > frames + 4)
    mark = len(client.out)
    back()
    client.wait_line("device", mark)
    mark = len(client.out)
    rig.check(f"{what}: it is back, at rest", wait_motion(client, False, mark), client.out[-3:])
    rig.check(f"{what}: nothing of the push before comes late", not any(map(any, motions(client, mark))), motions(client, mark))
    feeder.tell("hold held_fz")
    rig.check(f"{what}: the next push arrives", wait_motion(client, True, mark), client.out[-3:])
    rig.check(f"{what}: the bridge goes on by itself", bridge.running(), bridge.state())


def check_libusb(setup, feeder):
    client = setup.client("usb_client", "256f:c62e")
    words = client.wait_line("device").split(" ", 2)[2]
    rig.check("the other computer reads our names, the serial, 13 bytes and 500 mA",
              words == "tagwrench|SpaceMouse|tagwrench-sensor|13|500", words)
    bridge = bridge_on(setup, feeder)
    check_asleep(feeder, client)
    check_output_reports(bridge, client)
    check_gone_and_back("cable out and in", bridge, feeder, client, lambda: put(PORT_OFF, "1"),
                        lambda: put(PORT_OFF, "0"), "no computer at the other end")
    check_gone_and_back("controller unbound and bound", bridge, feeder, client, lambda: put(f"{OURS}/UDC", ""),
                        lambda: put(f"{OURS}/UDC", CONTROLLER), "taken down")
    check_gone_and_back("gadget down and up", bridge, feeder, client, lambda: gadget(setup, "down"),
                        lambda: gadget(setup, "up"), "taken down", goes_at_rest=True)
    check_killed_asleep(bridge, client)
    client.stop()


def check_killed_asleep(bridge, client):
    """Whoever is killed while nobody asks: rest is the last that the other computer hears when it asks again."""
    tell(client, "hold")
    os.kill(bridge.pid, signal.SIGKILL)
    bridge.wait()
    rig.check("killed while nobody asks: one process stays to bring rest", rig.wait_until(lambda: rig.processes("tw-gadget")))
    mark = len(client.out)
    tell(client, "go")
    rig.check("the other computer is told of rest when it asks again", wait_motion(client, False, mark), client.out[-3:])
    rig.check("and the process goes", rig.wait_until(lambda: not rig.processes("tw-")), rig.processes("tw-"))


def wrench(report):
    return (struct.unpack_from("<I", report, 57)[0], report[63],
            [v / 1e6 for v in struct.unpack_from("<6i", report, 1)])


def check_newtons(what, client, own):
    """Against the bridge's own file."""
    got = [wrench(report) for _, report in reports(client) if report[0] == 0x20 and len(report) == 64]
    numbers = [(sequence, values) for sequence, status, values in got if status in (0, 4)]
    strangers = [sequence for sequence, _ in numbers if sequence not in own]
    worst = max((abs(a - b) for sequence, values in numbers if sequence in own
                 for a, b in zip(values, own[sequence]["f_n"] + own[sequence]["m_nm"])), default=1)
    strong = max((abs(values[2]) for _, values in numbers), default=0)
    rig.check(f"{what} reads the bridge's own newtons to 1 uN and 1 uN m",
              len(numbers) > 10 and not strangers and worst <= 1.001e-6 and strong > 1,
              f"{len(numbers)} of {len(got)} reports, not in it {strangers[:5]}, {worst} off, strongest {strong} N")
    print(f"     {what}: {len(numbers)} reports with numbers, the push {strong:.4f} N")


def check_wrench(setup, feeder):
    status, _, err = gadget(setup, "up", "--face", "wrench", "--self-powered")
    rig.check("the wrench's face takes the SpaceMouse's place", status == 0 and "1209:7a6e" in err, err)
    bridge = bridge_on(setup, feeder, f"jsonl:{JSONL}")
    clients = []
    for what, arguments in (("hidapi over libusb", ["/usr/bin/python3", f"{setup.project}/tests/kernel/guest/hidapi_usb.py"]),
                            ("plain libusb", [f"{setup.programs}/usb_client"])):
        client = rig.Program(what, arguments + ["1209:7a6e"])
        words = client.wait_line("device")
        rig.check(f"{what} opens the wrench sensor", "tagwrench|wrench sensor|tagwrench-sensor" in words, words)
        for clip in ("hold held_fz", "loop rest"):
            feeder.tell(clip)
            mark = len(client.out)
            rig.wait_until(lambda: len(reports(client, mark)) > 12)
        client.stop(signal.SIGKILL)
        clients.append(client)
    status = bridge.stop(signal.SIGINT)
    rig.check("Ctrl-C ends the bridge with status 0", status == 0, bridge.state())
    with open(JSONL, encoding="utf-8") as file:
        own = {s["seq"]: s for s in map(json.loads, file.read().splitlines()) if s["status"] in ("ok", "saturated")}
    for client in clients:
        check_newtons(client.name, client, own)


def check_after(setup, before):
    status, _, err = gadget(setup, "down")
    rig.check("`gadget down` leaves configfs as it was", status == 0 and os.listdir(GADGETS) == before, err)
    status, _, err = gadget(setup, "down")
    rig.check("a second one finds nothing to do", status == 0 and "not up" in err, err)
    function = f"{FOREIGN}/functions/hid.usb0"
    os.mkdir(function)
    put(f"{function}/report_length", "8")
    os.mkdir(f"{FOREIGN}/configs/c.1")
    os.symlink(function, f"{FOREIGN}/configs/c.1/hid.usb0")
    put(f"{FOREIGN}/UDC", CONTROLLER)
    status, _, err = gadget(setup, "up")
    rig.check("a controller that somebody else has is left to him, by name", status == 2 and "belongs to g1" in err, err)
    rig.check("and nothing of ours is left", os.listdir(GADGETS) == before, os.listdir(GADGETS))
    _, kernel, _ = rig.run("dmesg")
    trouble = [line for line in kernel.splitlines() if "BUG" in line or "WARNING" in line or "corruption" in line]
    rig.check("the kernel complains of nothing", not trouble, trouble)


def body(setup):
    began = time.monotonic()
    rig.load("usbhid", "hid-generic", "evdev", "v4l2loopback video_nr=0 exclusive_caps=1")
    rig.start_udevd(setup.project + "/host/output/70-tagwrench.rules")
    feeder = setup.feeder(["rest", "held_fz"])
    check_before(setup)
    check_spacenavd(setup, feeder)
    check_libusb(setup, feeder)
    check_wrench(setup, feeder)
    check_after(setup, ["g1"])
    print(f"     {time.monotonic() - began:.0f} s")


rig.main(body)
