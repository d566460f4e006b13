"""The main job: frames from /dev/video0, and what spacenavd, hidapi and SDL programs get out of them."""
import csv
import json

import rig
from pushes import PUSHES, check_axis, numbers, six, wait_for_zero

AXES = ("fx", "fy", "fz", "mx", "my", "mz")
JSONL = "/run/bridge.jsonl"


def plateau(setup, name):
    """The frames of a clip during which the push is whole, without the oscillation at its start; and the truth there."""
    with open(setup.clip(name) + "/truth.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    keys = ("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")
    truth = [[float(row[key]) for key in keys] for row in rows]
    axis = AXES.index(name.split("_")[1])
    peak = max(abs(row[axis]) for row in truth)
    frames = [i for i, row in enumerate(truth) if abs(row[axis]) > 0.999 * peak]
    return frames[len(frames) // 3:], truth[frames[0]]


def check_newtons(setup, name, feeder_lines, reports):
    """The wrench on the plateau against the clip's truth. The springs are the model's own, the tags' places are learned."""
    frames, truth = plateau(setup, name)
    written = [(int(line.split()[3]), int(line.split()[2])) for line in feeder_lines if line.startswith(f"frame {name} ")]
    got = []
    for report in reports:
        # The driver stamps a frame while the feeder writes it; the feeder prints right after.
        index = next((index for time_ns, index in written if time_ns >= report["capture_ns"]), None)
        after_start = written and report["capture_ns"] > written[0][0] - 50_000_000
        if index in frames and after_start and report["status"] == 0:
            got.append(report["wrench"])
    if not rig.check(f"wrench reports arrive while {name} is held", len(got) >= 3, f"{len(got)} reports"):
        return
    mean = [sum(wrench[i] for wrench in got) / len(got) for i in range(6)]
    axis = AXES.index(name.split("_")[1])
    error = mean[axis] - truth[axis]
    rig.check(f"newtons of {name} agree with the truth", abs(error) < 0.1 * abs(truth[axis]),
              f"got {mean[axis]:.5g}, truth {truth[axis]:.5g} N or N m")
    print(f"     {name}: truth {truth[axis]:.5g}, read {mean[axis]:.5g} ({100 * error / truth[axis]:+.1f} %) "
          f"from {len(got)} reports")


def wrench_reports(lines):
    reports = []
    for line in lines:
        if line.startswith("wrench "):
            words = line.split()
            reports.append({"seq": int(words[2]), "status": int(words[3]), "capture_ns": int(words[4]),
                            "wrench": [float(word) for word in words[5:11]],
                            "sigma": [float(word) for word in words[11:17]]})
    return reports


def check_against_jsonl(reports):
    """What hidapi read equals what the bridge wrote into its own file, to a count."""
    names = ("ok", "acquiring", "lost", "doubtful", "saturated")
    with open(JSONL, encoding="utf-8") as file:
        own = {(s["seq"], names.index(s["status"])): s for s in map(json.loads, file.read().splitlines())}
    compared, worst, late, sigmas, strangers = 0, 0.0, 0, 0, []
    watchdog = sum(report["capture_ns"] == 0 for report in reports)  # its neutral reports belong to no frame
    reports = [report for report in reports if report["capture_ns"] != 0]
    for report in reports:
        sample = own.get((report["seq"], report["status"]))
        if sample is None:
            strangers.append((report["seq"], report["status"]))
            continue
        compared += 1
        if report["status"] in (0, 4):
            pairs = zip(report["wrench"] + report["sigma"], sample["f_n"] + sample["m_nm"] + sample["w_sigma"])
            worst = max([worst] + [abs(a - b) for a, b in pairs])
            sigmas += all(s > 0 for s in report["sigma"])
        late = max(late, abs(report["capture_ns"] - sample["t_ns"]))
    rig.check("every wrench report is in the bridge's own jsonl", compared > 100 and compared == len(reports),
              f"{compared} of {len(reports)}; not there: {strangers[:8]}")
    print(f"     {compared} reports compared; {watchdog} more came from the watchdog, because frames came late")
    rig.check("newtons and sigmas from the descriptor alone equal the bridge's own to 1 uN, 1 uN m", worst <= 1.001e-6,
              f"{worst} off")
    rig.check("sigmas are there", sigmas > 100, f"{sigmas} reports with six sigmas")
    rig.check("capture times agree to 1 us", late <= 1000, f"{late} ns off")


def check_push(setup, name, feeder, spnav, hid, sdl):
    axis, (hid_axis, hid_sign), (spnav_axis, spnav_sign) = PUSHES[name]
    marks = [len(program.out) for program in (feeder, spnav, hid, sdl)]
    feeder.tell(f"once {name}")
    feeder.wait_line(f"done {name}", marks[0])
    released = wait_for_zero(spnav, marks[1])
    events = six(spnav.out[marks[1]:], "motion", 1)
    check_axis("libspnav", name, events, spnav_axis, spnav_sign, 100)
    rig.check(f"{name}: release is exactly zero for libspnav", released, f"last event {events[-1:]}")
    wait_for_zero(hid, marks[2])
    check_axis("hidapi", name, six(hid.out[marks[2]:], "motion", 1), hid_axis, hid_sign, 70)
    check_newtons(setup, name, feeder.out[marks[0]:], wrench_reports(hid.out[marks[2]:]))
    moved = [numbers(line)[1:] for line in sdl.out[marks[3]:] if line.startswith("axis ")]
    far = max(moved, key=lambda e: abs(e[1]), default=None)
    rig.check(f"SDL sees {name} on axis {hid_axis}, sign {hid_sign:+d}",
              far and far[0] == hid_axis and far[1] * hid_sign > 6000, f"got {far}")


def check_hold(feeder, spnav, hid):
    """A push that does not change by a bit keeps producing events, and its release is exactly zero."""
    mark = len(feeder.out)
    feeder.tell("once held_fz")
    feeder.wait_line("done held_fz", mark)
    last = feeder.find("frame held_fz 15", mark)
    rig.wait_until(lambda: feeder.out[-1] != last and len(feeder.out) > mark + 25)
    marks = len(feeder.out), len(spnav.out), len(hid.out)
    rig.wait_until(lambda: len(feeder.out) - marks[0] >= 40)
    frames = len(feeder.out) - marks[0]
    samples = len(wrench_reports(hid.out[marks[2]:]))
    events = six(spnav.out[marks[1]:], "motion", 1)
    rig.check("a constant push keeps producing events", samples > 10 and len(events) >= samples - 2,
              f"{len(events)} events for {samples} samples")
    print(f"     held: {frames} frames, {samples} samples, {len(events)} libspnav events")
    zeros = sum(not any(event) for event in events)
    neutral = sum(report["status"] not in (0, 4) for report in wrench_reports(hid.out[marks[2]:]))
    rig.check("a constant push never falls to zero, but for frames that came too late", zeros <= neutral,
              f"{zeros} zeros, {neutral} neutral samples")
    mark = len(spnav.out)
    feeder.tell("loop rest")
    rig.check("the last event after the release of a long push is exactly zero", wait_for_zero(spnav, mark),
              spnav.out[-1:])


def check_led(bridge, hid):
    """spacenavd lights the LED when it opens the device; then a hidapi program switches it off and on."""
    rig.check("LED output of spacenavd arrives", bridge.wait_error("LED on", patience=10), bridge.state())
    for state in ("off", "on"):
        mark = len(bridge.err)
        hid.tell("led 1" if state == "on" else "led 0")
        rig.check(f"LED {state} written by hidapi arrives", bridge.wait_error(f"LED {state}", mark, patience=10), bridge.state())


def body(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "joydev", "v4l2loopback video_nr=0 exclusive_caps=1")
    daemon = rig.start_spacenavd()
    feeder = setup.feeder(["rest", "held_fz", *PUSHES])
    feeder.tell("loop rest")
    bridge = setup.bridge("spacemouse", "wrench", "joystick", f"jsonl:{JSONL}")
    rig.check("the bridge learns the rest pose from /dev/video0", bridge.wait_error("rest pose learned"), bridge.state())

    spnav = setup.client("spnav_client")
    spnav.wait_line("connected")
    hid = setup.client("hid_client", "256f:c62e", "1209:7a6e")
    for device, page in (("256f:c62e", "0001:0008"), ("1209:7a6e", "ff00:")):
        line = hid.wait_line(f"device {device}")
        rig.check(f"hidapi finds {device} with usage {page}", f" {page}" in line and "tagwrench" in line, line)
    hid.wait_line("ready")
    sdl = setup.client("sdl_client", "tagwrench joystick",
                       env={"SDL_VIDEODRIVER": "dummy", "SDL_JOYSTICK_DISABLE_UDEV": "1"})
    line = sdl.wait_line("joystick")
    rig.check("SDL finds a joystick with six axes", line.split()[1] == "6" and "tagwrench joystick" in line, line)

    rig.check_taken(daemon)
    check_led(bridge, hid)
    for name in PUSHES:
        check_push(setup, name, feeder, spnav, hid, sdl)
        feeder.tell("loop rest")
    check_hold(feeder, spnav, hid)

    reports = wrench_reports(hid.out)
    rig.check("Ctrl-C ends the bridge with status 0", bridge.stop(rig.signal.SIGINT) == 0, bridge.state())
    rig.check("its devices are gone", rig.wait_until(lambda: not rig.our_devices()), rig.our_devices())
    check_against_jsonl(reports)
    print(f"     {bridge.err[-1] if bridge.err else ''}")


rig.main(body)
