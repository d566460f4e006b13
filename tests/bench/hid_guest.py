"""The guest's part of the input device's benchmark: prints rows for hid_guest.cpp, `line|TEXT` and
`at_most|TEXT|VALUE|LIMIT|UNIT`."""
import bisect
import json
import os
import select
import signal
import statistics
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../kernel/checks"))
import nodes  # noqa: E402
import rig  # noqa: E402

RATE_HZ = 8
SOCKET, PROFILE = "/run/bench.sock", "/run/each.yaml"
THEIRS, OWN = "spacenavd, libspnav", "our spnav socket, libspnav"
PUCK_ID = "0003:0000256F:0000C62E"
EVENTS = 80      # of a client, before it is enough
TRIALS = 3
DEAD_MS = 80     # after which robot teleoperation programs take a silent device for gone
AS_MUCH = 1.5    # of the time that events take through spacenavd


def line(text):
    print(f"line|{text}", flush=True)


def at_most(text, value, limit, unit):
    print(f"at_most|{text}|{value:.6g}|{limit:.6g}|{unit}", flush=True)


def p99(values):
    return sorted(values)[min(len(values) - 1, int(0.99 * len(values)))]


def tail(values):
    return f"median {statistics.median(values):.2f} ms, p99 {p99(values):.2f} of {len(values)}"


class Samples:
    """What the bridge wrote: when each picture was taken, and when it was handed to the outputs."""

    def __init__(self, path):
        with open(path, encoding="utf-8") as file:
            samples = [json.loads(text) for text in file.read().split("\n")[:-1]]
        self.captured = [sample["t_ns"] for sample in samples]
        self.put_out = [sample["t_ns"] + 1000 * sample["latency_us"] for sample in samples]

    def latencies(self, times):
        """(capture to event, output to event), ms, of the first event that follows each sample."""
        capture, transport, known = [], [], -1
        for time in times:
            index = bisect.bisect_right(self.put_out, time) - 1
            if index <= known or index < 0:
                continue
            known = index
            capture.append((time - self.captured[index]) / 1e6)
            transport.append((time - self.put_out[index]) / 1e6)
        return capture, transport


def times(client, word, since):
    return [int(text.split()[1]) for text in client.out[since:] if text.startswith(word + " ")]


class Clients:
    """Unmodified libspnav, hidapi and SDL; each beside the word that its events begin with."""

    def __init__(self, setup):
        self.daemon = setup.client("spnav_client")
        self.own = setup.client("spnav_client", env={"SPNAV_SOCKET": SOCKET})
        self.hid = setup.client("hid_client", "256f:c62e", "1209:7a6e")
        self.sdl = setup.client("sdl_client", "tagwrench joystick",
                                env={"SDL_VIDEODRIVER": "dummy", "SDL_JOYSTICK_DISABLE_UDEV": "1"})
        for client, word in ((self.daemon, "connected"), (self.own, "connected"), (self.hid, "ready"), (self.sdl, "joystick")):
            client.wait_line(word)
        self.rows = {THEIRS: (self.daemon, "motion"), OWN: (self.own, "motion"),
                     "SpaceMouse, hidapi (hidraw)": (self.hid, "motion"), "wrench sensor, hidapi (hidraw)": (self.hid, "wrench"),
                     "joystick, SDL": (self.sdl, "axis")}

    def motions(self, since_ns):
        """Per client of the puck: (time in ns, moves) of every event since then."""
        found = {}
        for name, (client, word) in self.rows.items():
            if word == "motion":
                lines = [text.split() for text in client.out if text.startswith("motion ")]
                found[name] = [(int(w[1]), any(float(v) for v in w[2:8])) for w in lines if int(w[1]) >= since_ns]
        return found

    def first_zeros(self, since_ns):
        """When each was told of zero, ns; None: not yet."""
        return {name: next((time for time, moves in events if not moves), None)
                for name, events in self.motions(since_ns).items()}

    def marks(self):
        return {name: len(client.out) for name, (client, _) in self.rows.items()}


def latency(feeder, clients, jsonl, shown):
    """Of the clients that are named; the ratio of the two ways to spnav."""
    feeder.tell("loop push_fx")
    mark = clients.marks()
    rig.wait_until(lambda: all(len(times(*clients.rows[name], mark[name])) >= EVENTS for name in shown))
    feeder.tell("loop rest")
    samples = Samples(jsonl)
    transports = {}
    for name in shown:
        capture, transports[name] = samples.latencies(times(*clients.rows[name], mark[name]))
        line(f"  {name}: {tail(capture)}; output to event {tail(transports[name])}")
    return statistics.median(transports[OWN]) / statistics.median(transports[THEIRS])


def wait_pushed(clients):
    """Until every client of the puck is in the middle of a push."""
    since = rig.monotonic_ns()
    if not rig.wait_until(lambda: all(sum(moves for _, moves in events) > 8 for events in clients.motions(since).values())):
        raise rig.GaveUp("no push arrives")


def zeros_after(clients, since_ns):
    rig.wait_until(lambda: all(clients.first_zeros(since_ns).values()), 20)
    return clients.first_zeros(since_ns)


def report_stop(what, delays, target):
    for name, values in delays.items():
        text = ", ".join("none" if value is None else f"{value:.0f}" for value in values)
        worst = max((float("inf") if value is None else value) for value in values)
        at_most(f"{what}: {name}, zero after {text} ms, worst", worst, target, "ms")


def camera_dies(setup, feeder, clients):
    """From the instant at which the next picture was due."""
    delays = {}
    for _ in range(TRIALS):
        feeder.tell("hold held_fz")
        wait_pushed(clients)
        feeder.stop(signal.SIGKILL)
        last = max(int(text.split()[3]) for text in feeder.out[-2:] if text.startswith("frame "))
        for name, zero in zeros_after(clients, last).items():
            delays.setdefault(name, []).append(None if zero is None else (zero - last) / 1e6 - 1000 / RATE_HZ)
        feeder = setup.feeder(["rest", "held_fz", "push_fx"], rate=RATE_HZ)
    report_stop("camera killed", delays, DEAD_MS)
    return feeder


def bridge_dies(feeder, bridge, clients):
    feeder.tell("hold held_fz")
    wait_pushed(clients)
    killed = rig.monotonic_ns()
    os.kill(bridge.pid, signal.SIGKILL)
    delays = {name: [None if zero is None else (zero - killed) / 1e6] for name, zero in zeros_after(clients, killed).items()}
    report_stop("bridge killed (kill -9)", delays, DEAD_MS)


def slow_hidraw(fd):
    """Opened before the pushes, read now, at rest."""
    waiting = 0
    while select.select([fd], [], [], 0)[0]:
        os.read(fd, 64)
        waiting += 1
    newest = select.select([fd], [], [], rig.PATIENCE)[0] and os.read(fd, 64)
    zero = bool(newest) and not any(newest[1:13])
    line(f"hidraw: {waiting} reports wait for a program that did not read (the kernel's ring of 64; tagwrench_read_newest() skips them)")
    at_most("hidraw: after these comes something else than what is, zero", 0 if zero else 1, 0, "reports")


def start_bridge(setup, first, second, jsonl):
    bridge = setup.bridge(first, second, "wrench", "joystick", f"jsonl:{jsonl}", more=["--profile", PROFILE])
    rig.check("the bridge learns the rest pose", bridge.wait_error("rest pose learned"), bridge.state())
    return bridge


def body(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "joydev", "v4l2loopback video_nr=0 exclusive_caps=1")
    with open(PROFILE, "w", encoding="utf-8") as file:
        file.write("name: each\nrate_hz: 0\n")
    daemon = rig.start_spacenavd()
    feeder = setup.feeder(["rest", "held_fz", "push_fx"], rate=RATE_HZ)
    feeder.tell("loop rest")
    bridge = start_bridge(setup, "spacemouse", f"spnav:{SOCKET}", "/run/first.jsonl")
    clients = Clients(setup)
    rig.check_taken(daemon)
    slow = os.open(nodes.hidraw_node(PUCK_ID), os.O_RDWR | os.O_NONBLOCK)
    line("Capture to event, and of this from the bridge's outputs to the event; a report for each picture:")
    ratio = latency(feeder, clients, "/run/first.jsonl", list(clients.rows))
    rig.wait_until(lambda: not any(events[-1][1] for events in clients.motions(0).values()))
    slow_hidraw(slow)
    feeder = camera_dies(setup, feeder, clients)
    bridge_dies(feeder, bridge, clients)

    feeder.tell("loop rest")
    start_bridge(setup, f"spnav:{SOCKET}", "spacemouse", "/run/second.jsonl")
    rig.check_taken(daemon)
    line("The bridge serves one output after the other; the same with our socket before the SpaceMouse:")
    other_ratio = latency(feeder, clients, "/run/second.jsonl", [THEIRS, OWN])
    at_most("output to event, our socket beside spacenavd, geometric mean of both orders", (ratio * other_ratio) ** 0.5,
            AS_MUCH, "x")


rig.main(body)
