"""Blender, unmodified, turns and moves its view as the sensor is pushed: axis, sign and about the angle.

Blender takes counts for a speed, 0.62 degrees a second and count, with a dead zone; it draws as fast as it can. On a
busy machine the angle is no better known than that.
"""
import argparse
import math
import os
import subprocess

import desktop
from desktop import check, degrees, inverse, rotated, rotation_vector, times

DEGREES = 0.62  # per second and count
SYSTEM_SOCKET = "/var/run/spnav.sock"
# Which way the view turns about its own axes.
TURNS = {"mx": (0, -1), "my": (2, +1), "mz": (1, -1)}


def expected_angle(motions, index):
    """Counts times the time that they lasted, in degrees."""
    total = 0.0
    for (time, counts), (later, _) in zip(motions, motions[1:]):
        total += abs(counts[index]) * min(later - time, 0.1)
    return DEGREES * total


def with_a_place_for_the_socket(command):
    """Blender does not look at SPNAV_SOCKET unless there is something at the usual place: a /run of its own has it."""
    if os.path.exists(SYSTEM_SOCKET):
        return command
    own = ["unshare", "-Urm", "sh", "-c", "mount -t tmpfs t /run && touch /run/spnav.sock && exec \"$@\"", "sh"]
    if subprocess.run(own + ["true"], capture_output=True, check=False).returncode != 0:
        desktop.skip(f"there is nothing at {SYSTEM_SOCKET}, which Blender wants to see, and no mount namespace to be had; "
                     f"`sudo touch {SYSTEM_SOCKET}` helps")
    return own + command


def check_turn(axis, motions, before, after):
    turned = rotation_vector(times(inverse(before[1]), after[1]))
    index, sign = TURNS[axis]
    about = max(range(3), key=lambda i: abs(turned[i]))
    check(f"{axis}: the view turns about its {'-' if sign < 0 else '+'}{'xyz'[index]}",
          about == index and turned[index] * sign > 0, f"{degrees(turned)} deg")
    expected = expected_angle(motions, desktop.PUSHES[axis][0])
    angle = math.degrees(math.hypot(*turned))
    check(f"{axis}: by about as much as counts and seconds make", 0.5 * expected < angle < 1.6 * expected,
          f"{angle:.1f} deg, expected {expected:.1f}")


def check_shift(axis, before, after):
    shift = rotated(inverse(before[1]), [a - b for a, b in zip(after[0], before[0])])
    closer = before[2] / after[2]
    told = f"moved {[round(v, 2) for v in shift]}, distance times {1 / closer:.3f}"
    if axis == "fx":
        check("fx: the view pans to -x", shift[0] < -0.1 and abs(shift[1]) < abs(shift[0]) / 3, told)
    if axis == "fy":
        check("fy: the distance grows", closer < 0.95, told)
    if axis == "fz":
        check("fz: the view pans to -y", shift[1] < -0.1 and abs(shift[0]) < abs(shift[1]) / 3, told)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--tagwrench", required=True)
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    desktop.need("Xvfb", "xdotool", "import", "blender")
    here = os.path.dirname(os.path.abspath(__file__))
    blender = with_a_place_for_the_socket(["blender", "--factory-startup", "--window-geometry", "0", "0", "800", "600",
                                           "--python", here + "/blender_view.py"])
    with desktop.Desk(arguments.tagwrench, arguments.out) as desk:
        desk.spnav_daemon()
        desk.screen()
        view = desktop.View(arguments.out + "/view")
        desk.environment["TAGWRENCH_VIEW"] = view.path
        process = desk.start(*blender, log="blender")
        desktop.wait_until(lambda: view.lines() or process.poll() is not None, "Blender's view")
        desk.point(300, 250)  # over the view in three dimensions
        witness = desktop.Witness(desk.socket)
        desk.push_every_axis(view, witness, lambda axis: 0.35 if axis[0] == "m" else 0.2, check_turn, check_shift)
        check("Blender has stayed connected over six starts of the bridge", process.poll() is None)
    desktop.finish()


main()
