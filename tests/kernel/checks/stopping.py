"""The devices come to rest by themselves: a dead camera, a stopped bridge, a killed bridge."""
import os
import signal

import rig
from pushes import six, wait_for_zero

RATE_HZ = 8
NEUTRAL_WITHIN_MS = 1000  # after the deadline: the last frame's capture time and one frame period. 45 to 75 ms are usual
                          # in an emulated guest, 100 when other tests run beside it: the limit finds a hang, no slowness
TRIALS = 5


class Reports:
    """The wrench device's reports, as (arrival ns, status, capture ns)."""

    def __init__(self, hid):
        self.hid = hid

    def all(self, since):
        lines = [line.split() for line in self.hid.out[since:] if line.startswith("wrench ")]
        return [(int(w[1]), int(w[3]), int(w[4])) for w in lines]

    def mark(self):
        return len(self.hid.out)

    def wait_numbers(self, since, count=5):
        """Until the bridge reports numbers again."""
        def numbers():
            return sum(status in (0, 4) for _, status, _ in self.all(since)) >= count
        if not rig.wait_until(numbers):
            raise rig.GaveUp(f"the bridge reports no numbers (last: {self.all(since)[-3:]})")

    def neutral_delay_ms(self, since):
        """From the deadline of the last frame with numbers to the neutral report that follows it; None: no such report."""
        last = None
        for arrival, status, capture in self.all(since):
            if status in (0, 4):
                last = capture
            elif last is not None:
                return (arrival - last) / 1e6 - 1000 / RATE_HZ
        return None


def feed(setup):
    """The camera, held in a push."""
    feeder = setup.feeder(["rest", "held_fz"], rate=RATE_HZ)
    feeder.tell("hold held_fz")
    return feeder


def judge(what, delays):
    times = ", ".join("none" if d is None else f"{d:.0f}" for d in delays)
    whole = [d for d in delays if d is not None]
    rig.check(f"{what}: neutral every time", len(whole) == TRIALS, times)
    rig.check(f"{what}: neutral within {NEUTRAL_WITHIN_MS} ms of the deadline",
              all(delay <= NEUTRAL_WITHIN_MS for delay in whole), f"ms after the deadline: {times}")
    print(f"     {what}: neutral after {times} ms")


def one_trial(reports, spnav, provoke):
    """In the middle of a push; after the first frames that follow an interruption."""
    since, mark = reports.mark(), len(spnav.out)
    reports.wait_numbers(since)
    if not rig.wait_until(lambda: any(map(any, six(spnav.out[mark:], "motion", 1)))):
        raise rig.GaveUp(f"libspnav sees no push: {spnav.out[-3:]}")
    provoke()
    rig.wait_until(lambda: reports.neutral_delay_ms(since) is not None, 10)
    return reports.neutral_delay_ms(since)


def killed_camera(setup, feeder, bridge, reports, spnav):
    delays, zeros = [], []
    for _ in range(TRIALS):
        mark = len(spnav.out)
        delays.append(one_trial(reports, spnav, lambda: feeder.stop(signal.SIGKILL)))
        zeros.append(wait_for_zero(spnav, mark))
        feeder = feed(setup)
    judge("camera killed", delays)
    rig.check("libspnav sees exact zero every time when the camera dies", all(zeros), zeros)
    rig.check("the bridge goes on when the camera is back", bridge.running(), bridge.state())
    return feeder


def stopped_bridge(bridge, reports, spnav):
    delays, zeros = [], []
    for _ in range(TRIALS):
        mark = len(spnav.out)
        delays.append(one_trial(reports, spnav, lambda: os.kill(bridge.pid, signal.SIGSTOP)))
        zeros.append(wait_for_zero(spnav, mark))
        os.kill(bridge.pid, signal.SIGCONT)
    judge("bridge stopped", delays)
    rig.check("libspnav sees exact zero every time when the bridge is stopped", all(zeros), zeros)
    reports.wait_numbers(reports.mark())
    rig.check("the bridge goes on when it is continued", bridge.running(), bridge.state())


def killed_bridge(bridge, reports, spnav):
    reports.wait_numbers(reports.mark())
    mark = len(spnav.out)
    moving = rig.wait_until(lambda: six(spnav.out[mark:], "motion", 1))
    rig.check("motion right before the kill", moving and any(moving[-1]), moving)
    os.kill(bridge.pid, signal.SIGKILL)
    bridge.wait()
    zero = wait_for_zero(spnav, mark)
    rig.check("kill -9: the last event is exactly zero", zero, spnav.out[-1:])
    gone = rig.wait_until(lambda: not rig.our_devices())
    rig.check("kill -9: no device is left behind", gone, rig.our_devices())
    left = rig.wait_until(lambda: not rig.processes("tagwrench") and not rig.processes("tw-"))
    rig.check("kill -9: no process is left behind", left, rig.processes("tagwrench") + rig.processes("tw-"))


def body(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "v4l2loopback video_nr=0 exclusive_caps=1")
    daemon = rig.start_spacenavd()
    feeder = setup.feeder(["rest", "held_fz"], rate=RATE_HZ)
    feeder.tell("loop rest")
    bridge = setup.bridge("spacemouse", "wrench", "joystick")
    rig.check("the bridge learns the rest pose", bridge.wait_error("rest pose learned"), bridge.state())
    spnav = setup.client("spnav_client")
    spnav.wait_line("connected")
    hid = setup.client("hid_client", "256f:c62e", "1209:7a6e")
    hid.wait_line("ready")
    rig.check_taken(daemon)
    feeder.tell("hold held_fz")
    reports = Reports(hid)
    killed_camera(setup, feeder, bridge, reports, spnav)
    stopped_bridge(bridge, reports, spnav)
    killed_bridge(bridge, reports, spnav)


rig.main(body)
