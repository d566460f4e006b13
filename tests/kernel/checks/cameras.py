"""Cameras as they come: absent, busy, wrong, broken, unplugged; a second driver; Ctrl-C at any moment."""
import json
import os
import signal
import socket
import time

import page
import rig

JSONL = "/run/cameras.jsonl"
VIVID = "/dev/video2"


def samples():
    """What the bridge has written; a last line without an end is not counted."""
    try:
        with open(JSONL, encoding="utf-8") as file:
            return [json.loads(line) for line in file.read().split("\n")[:-1]]
    except FileNotFoundError:
        return []


def good(since=0):
    return sum(sample["status"] == "ok" for sample in samples()[since:])


def refuse(what, bridge, *parts):
    """Exit status 2, one line, and the line says what it is about."""
    status = bridge.wait()
    line = bridge.err[0] if bridge.err else ""
    rig.check(f"{what}: status 2 and one line", status == 2 and len(bridge.err) == 1 and not bridge.out, bridge.state())
    rig.check(f"{what}: the line names {' and '.join(parts)}", all(part in line for part in parts), line)
    print(f"     {line}")


def refusals(setup):
    refuse("no such camera", setup.bridge("terminal", source="v4l2:/dev/video9"), "/dev/video9")
    refuse("a node that cannot capture", setup.bridge("terminal", source="v4l2:/dev/video1"), "/dev/video1", "capture")
    feeder = setup.feeder(["rest"])
    refuse("a mode that the camera does not have",
           setup.bridge("terminal", source="v4l2:/dev/video0,640x480@30,MJPG"), "/dev/video0", "320x240")
    refuse("a camera that only root may open", setup.bridge("terminal", user="1500"), "/dev/video0", "permission")
    refuse("no /dev/uhid", setup.bridge("spacemouse"), "/dev/uhid")
    feeder.stop()

    holder = rig.Program("v4l2-ctl", ["v4l2-ctl", "-d", VIVID, "--stream-mmap", "--stream-count=0"])
    rig.check("another program streams from vivid", holder.wait_error("fps"), holder.state())
    refuse("a busy camera", setup.bridge("terminal", source=f"v4l2:{VIVID}", sensor=""), VIVID, "busy")
    holder.stop(signal.SIGKILL)


def broken_jpeg(setup):
    """MJPG frames that end in the middle are skipped and counted."""
    feeder = setup.feeder(["jpeg_rest", "jpeg_held_fz"], kind="MJPG")
    feeder.tell("loop jpeg_rest")
    bridge = setup.bridge(f"jsonl:{JSONL}")
    rig.check("the bridge learns the rest pose from MJPG", bridge.wait_error("rest pose learned"), bridge.state())
    feeder.tell("once jpeg_held_fz")
    rig.wait_until(lambda: good() >= 20)
    before = len(samples())
    mark = len(feeder.out)
    feeder.tell("truncate 6")
    rig.wait_until(lambda: len(feeder.out) >= mark + 12)
    rig.check("MJPG goes on after truncated frames", rig.wait_until(lambda: good(before) >= 12), bridge.state())
    lost = sum(sample["dropped"] for sample in samples()[before:])
    rig.check("truncated frames are counted", lost >= 6, f"{lost} dropped of 6 truncated")
    rig.check("Ctrl-C ends the bridge with status 0", bridge.stop(signal.SIGINT) == 0, bridge.state())
    feeder.stop()


def reconnection(setup):
    """A camera that dies and comes back; YUYV on the way."""
    feeder = setup.feeder(["rest"], kind="YUYV")
    feeder.tell("loop rest")
    bridge = setup.bridge(f"jsonl:{JSONL}")
    rig.check("the bridge learns the rest pose from YUYV", bridge.wait_error("rest pose learned"), bridge.state())
    rig.wait_until(lambda: good() >= 3)
    said = len(bridge.err)
    feeder.stop(signal.SIGKILL)
    rig.check("a dead camera is said", rig.wait_until(lambda: len(bridge.err) > said), bridge.state())
    rig.check("a dead camera is a neutral sample", rig.wait_until(lambda: samples()[-1]["status"] == "lost"), samples()[-1:])
    before = len(samples())
    feeder = setup.feeder(["rest"], kind="YUYV")
    feeder.tell("loop rest")
    rig.check("the camera is back without a restart", rig.wait_until(lambda: good(before) >= 5), bridge.state())
    rig.check("once each is it said that the camera went and came", len(bridge.err) - said == 2, bridge.err[said:])
    for line in bridge.err[said:]:
        print(f"     {line}")
    rig.check("SIGTERM ends the bridge with status 0", bridge.stop() == 0, bridge.state())
    feeder.stop()


def controls():
    """The values of vivid's controls by name, without those that change by themselves."""
    values = {}
    for line in rig.run("v4l2-ctl", "-d", VIVID, "--list-ctrls")[1].splitlines():
        words = line.split()
        value = next((word for word in words if word.startswith("value=")), None)
        if value is not None and "volatile" not in line and "read-only" not in line:
            values[words[0]] = value
    return values


def second_driver(setup):
    """vivid: no tags in its pictures, and a stricter driver."""
    bridge = setup.bridge(f"jsonl:{JSONL}", source=f"v4l2:{VIVID}", sensor="", more=["--frames", "20"])
    status = bridge.wait()
    states = {sample["status"] for sample in samples()}
    rig.check("vivid streams; without tags the status is acquiring",
              status == 0 and len(samples()) >= 20 and states == {"acquiring"}, f"{bridge.state()}; {states}")


def start_on_vivid(setup):
    return setup.bridge("spacemouse", "wrench", "joystick", source=f"v4l2:{VIVID}", sensor="")


def interruptions(setup):
    """Ctrl-C at moments that are spread over the start and the run."""
    rig.check("vivid has automatic gain", controls().get("gain_automatic") == "value=1", controls())
    start = time.monotonic()
    bridge = start_on_vivid(setup)
    rig.check("vivid is a camera for the devices", bridge.wait_error("source:"), bridge.state())
    start_time = time.monotonic() - start
    rig.check("the gain is locked while the bridge runs", controls().get("gain_automatic") == "value=0", controls())
    ends, left, altered = [bridge.stop(signal.SIGINT)], [], []
    for step in range(8):
        gain = "gain_automatic=0,gain=33" if step % 2 else "gain_automatic=1"
        rig.run("v4l2-ctl", "-d", VIVID, "--set-ctrl", gain)
        before = controls()
        bridge = start_on_vivid(setup)
        time.sleep(start_time * step / 5)
        ends.append(bridge.stop(signal.SIGINT))
        if not rig.wait_until(lambda: not rig.our_devices() and not rig.processes("tw-")):
            left.append(rig.our_devices())
        now = controls()
        altered += [f"{name} {now.get(name)}, was {value}" for name, value in before.items() if now.get(name) != value]
    rig.check("Ctrl-C at any moment: a clean end", all(end in (0, -signal.SIGINT) for end in ends), ends)
    rig.check("Ctrl-C at any moment: no device left", not left, left)
    rig.check("Ctrl-C at any moment: the camera's controls as before", not altered, altered)
    print(f"     exit statuses every {start_time / 5:.2f} s: {ends[1:]}")


def settings_from_a_page(setup):
    """What a page sets is set in the camera, told by it, and stays what the run keeps fixed."""
    rig.run("v4l2-ctl", "-d", VIVID, "--set-ctrl", "gain_automatic=1,brightness=100")
    bridge = setup.bridge(f"web:127.0.0.1:{page.PORT}", source=f"v4l2:{VIVID}", sensor="")
    rig.check("the bridge serves pages", bridge.wait_error("source:"), bridge.state())
    seen = page.Page()
    state = seen.next(lambda message: message["type"] == "state" and message["camera_controls"])
    found = {control["name"]: control for control in state["camera_controls"]}
    rig.check("a page is told vivid's settings", found.get("Brightness", {}).get("value") == 100, sorted(found))
    for name, key, value in (("Brightness", "brightness", 120), ("Gain", "gain", 77)):
        answer = seen.ask("camera_set", control=found[name]["id"], value=value)
        rig.check(f"{name} is set from a page", answer["ok"] and controls().get(key) == f"value={value}", f"{answer}; {controls()}")
    rig.check("what is set is told", seen.next(lambda message: message["type"] == "state" and any(
        control["name"] == "Gain" and control["value"] == 77 for control in message["camera_controls"])))
    answer = seen.ask("camera_set", control=1, value=0)
    rig.check("a setting that there is not is refused in words", not answer["ok"] and "no such setting" in answer["text"], answer)
    rig.check("the bridge ends with status 0", bridge.stop() == 0, bridge.state())
    rig.check("the gain is automatic again", controls().get("gain_automatic") == "value=1", controls())


def signs_of_life(setup):
    """A search through cameras takes longer than systemd may wait for a sign of life."""
    notify = "/run/cameras.notify"
    systemd = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    systemd.bind(notify)
    systemd.settimeout(60)
    bridge = rig.Program("tagwrench", [setup.tagwrench, "run", "--wait", "--output", "terminal"],
                         env={"NOTIFY_SOCKET": notify, "WATCHDOG_USEC": "1000000"})
    before = []
    try:
        while not before or not before[-1].startswith("READY=1"):
            before.append(systemd.recv(1024).decode())
    except TimeoutError:
        pass
    rig.check("a camera without tags is waited past", before and "waiting" in before[-1], f"{before}; {bridge.state()}")
    rig.check("systemd hears of the search every second", before.count("WATCHDOG=1") >= 2, f"{before}; {bridge.state()}")
    rig.check("SIGTERM ends the waiting with status 0", bridge.stop() == 0, bridge.state())
    systemd.close()
    os.remove(notify)


def body(setup):
    rig.load("v4l2loopback devices=2 video_nr=0,1 exclusive_caps=1,1",
             "vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0x00 vid_cap_nr=2")
    refusals(setup)
    rig.load("uhid", "hid-generic", "uinput", "evdev")
    broken_jpeg(setup)
    reconnection(setup)
    second_driver(setup)
    signs_of_life(setup)
    settings_from_a_page(setup)
    interruptions(setup)


rig.main(body)
