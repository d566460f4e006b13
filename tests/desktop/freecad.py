"""FreeCAD, unmodified, turns and moves its view as the sensor is pushed: axis, sign and angle of its camera.

FreeCAD turns by 1e-4 rad a count and event, and moves by counts and events too. So what a second program on the socket is told
says exactly where the camera must end.
"""
import argparse
import math
import os

import desktop
from desktop import check, degrees, inverse, quaternion, rotated, rotation_vector, times

RADIANS = 1e-4  # per count and event
SHARES = {"fx": 0.15, "fy": 0.15, "fz": 0.12, "mx": 0.25, "my": 0.25, "mz": 0.25}


def expected_turn(motions):
    """The rotation, in the camera's frame, that these events make: spnav's rx ry rz about -x, -z and -y."""
    q = [0.0, 0.0, 0.0, 1.0]
    for _, (_, _, _, rx, ry, rz) in motions:
        q = times(q, quaternion([-rx * RADIANS, -rz * RADIANS, -ry * RADIANS]))
    return rotation_vector(q)


def check_turn(axis, motions, before, after):
    turned = rotation_vector(times(inverse(before[1]), after[1]))
    expected = expected_turn(motions)
    error = math.degrees(math.dist(turned, expected))
    size = math.degrees(math.dist(expected, (0, 0, 0)))
    about = max(range(3), key=lambda i: abs(turned[i]))
    wanted = {"mx": 0, "my": 1, "mz": 2}[axis]
    check(f"{axis}: the camera turns about its -{'xyz'[wanted]}", about == wanted and turned[about] < 0, f"{degrees(turned)} deg")
    check(f"{axis}: by the angle that the events make", size > 5 and error < 0.02 * size + 0.2,
          f"{math.degrees(math.hypot(*turned)):.2f} deg, expected {size:.2f}")


def check_shift(axis, before, after):
    """Which way the camera goes in its own frame; along its line of sight it is the zoom that changes."""
    shift = rotated(inverse(before[1]), [a - b for a, b in zip(after[0], before[0])])
    zoom = after[2] / before[2]
    told = f"moved {[round(v, 2) for v in shift]}, height times {zoom:.3f}"
    if axis == "fx":
        check("fx: the camera moves to -x", shift[0] < -1 and abs(shift[1]) < abs(shift[0]) / 3, told)
    if axis == "fy":
        check("fy: the camera moves to -y", shift[1] < -1 and abs(shift[0]) < abs(shift[1]) / 3, told)
    if axis == "fz":
        check("fz: the view comes closer", zoom < 0.95, told)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--tagwrench", required=True)
    parser.add_argument("--out", required=True)
    arguments = parser.parse_args()
    desktop.need("Xvfb", "xdotool", "import", "freecad")
    here = os.path.dirname(os.path.abspath(__file__))
    with desktop.Desk(arguments.tagwrench, arguments.out) as desk:
        desk.spnav_daemon()
        desk.screen()
        view = desktop.View(arguments.out + "/view")
        desk.environment["TAGWRENCH_VIEW"] = view.path
        freecad = desk.start("freecad", "-u", here + "/freecad.cfg", here + "/freecad_view.FCMacro", log="freecad")
        desktop.wait_until(lambda: view.lines() or freecad.poll() is not None, "FreeCAD's view")
        desk.focus("FreeCAD")
        witness = desktop.Witness(desk.socket)
        desk.push_every_axis(view, witness, SHARES.get, check_turn, check_shift)
        check("FreeCAD has stayed connected over six starts of the bridge", freecad.poll() is None)
    desktop.finish()


main()
