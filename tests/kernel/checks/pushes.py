"""Which way each push must come out of the devices, and how the clients' lines are read."""
import rig

PUSHES = {
    # Camera looks up from below: HID X Y Z = camera x -y -z. spacenavd swaps Y and Z of a 3Dconnexion device and negates
    # all but X and RX, and libspnav reports x y z rx ry rz.
    # push: (axis of the wrench, HID axis and sign, spnav axis and sign)
    "push_fx": (0, (0, +1), (0, +1)),
    "push_fy": (1, (1, -1), (2, +1)),
    "push_fz": (2, (2, -1), (1, +1)),
    "push_mx": (3, (3, +1), (3, +1)),
    "push_my": (4, (4, -1), (5, +1)),
    "push_mz": (5, (5, -1), (4, +1)),
}


def numbers(line):
    return [float(word) for word in line.split()[1:]]


def six(lines, word, skip):
    """The six numbers of every `word` line, after `skip` others."""
    return [numbers(line)[skip:skip + 6] for line in lines if line.startswith(word + " ")]


def largest(events):
    """The event that is farthest from zero, and its largest axis."""
    event = max(events, key=lambda e: max(map(abs, e)))
    axis = max(range(6), key=lambda i: abs(event[i]))
    return event, axis


def check_axis(who, name, events, wanted_axis, sign, strong):
    """One axis moves, in the documented direction, and the others stay well below it."""
    if not rig.check(f"{who} sees {name}", events, "no event"):
        return
    event, axis = largest(events)
    rest = max(abs(v) for i, v in enumerate(event) if i != wanted_axis)
    rig.check(f"{who} sees {name} on axis {wanted_axis}, sign {sign:+d}",
              axis == wanted_axis and event[axis] * sign >= strong and rest <= abs(event[axis]) / 3,
              f"got {event}, wanted at least {strong} there and a third of it elsewhere")


def wait_for_zero(client, since):
    """Until the client's last motion is exactly nothing."""
    def at_rest():
        events = six(client.out[since:], "motion", 1)
        return events and events[-1] == [0.0] * 6
    return rig.wait_until(at_rest)
