"""A live udevd with our rules: what they open and to whom, and that they open nothing else."""
import grp
import os
import re
import stat

import nodes
import rig

OWN_ID_RULE = 'SUBSYSTEM=="hidraw", KERNELS=="0003:1209:7A70.*", GROUP="tagwrench", MODE="0660", TAG+="uaccess"\n'
RULES = "/run/70-tagwrench.rules"
PUCK, WRENCH, OWN, FOREIGN = "0003:0000256F:0000C62E", "0003:00001209:00007A6E", "0003:00001209:00007A70", "0003:0000256F:0000C635"


def properties(path):
    _, out, err = rig.run("udevadm", "info", "--query=property", path)
    return dict(line.split("=", 1) for line in out.splitlines() if "=" in line) or {"error": err}


def check_opened(what, path):
    """To the group tagwrench, and by the tag to the user at the seat (logind gives it; the guest of the package has one)."""
    if not rig.check(f"{what} has a node", path):
        return
    found = os.stat(path)
    given = oct(stat.S_IMODE(found.st_mode)), found.st_uid, grp.getgrgid(found.st_gid).gr_name
    rig.check(f"{what} is open to the group tagwrench and to nobody else", given == ("0o660", 0, "tagwrench"), given)
    tags = properties(path).get("CURRENT_TAGS", "")
    rig.check(f"{what} is tagged for the user at the seat", ":uaccess:" in tags, properties(path))


def check_closed(what, path, owner=0):
    if not rig.check(f"{what} has a node", path):
        return
    found = os.stat(path)
    given = oct(stat.S_IMODE(found.st_mode)), found.st_uid, found.st_gid
    rig.check(f"{what} is open to {'its service' if owner else 'root'} alone", given == ("0o600", owner, 0), given)
    tags = properties(path).get("TAGS", "")
    rig.check(f"{what} has no tag of ours", ":uaccess:" not in tags, tags)


def settle():
    rig.run("udevadm", "settle", "-t", "60")


def main(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "joydev")
    with open(setup.project + "/host/output/70-tagwrench.rules", encoding="utf-8") as ours, \
            open(RULES, "w", encoding="utf-8") as copy:
        copy.write(ours.read() + OWN_ID_RULE)
    rig.start_udevd(RULES)
    status, _, err = rig.run("udevadm", "test", "/sys/devices/virtual/misc/uhid")
    faults = [line for line in err.splitlines() if "70-tagwrench.rules:" in line and not re.search(r" (OWNER|GROUP|MODE) \w+$", line)]
    rig.check("udevadm finds no fault in the rules", status == 0 and not faults, faults or err[-500:])
    check_closed("/dev/uhid", "/dev/uhid", rig.SERVICE_ID)
    check_closed("/dev/uinput", "/dev/uinput", rig.SERVICE_ID)

    source = f"sim:{setup.clip('rest')}.yaml"
    bridge = setup.bridge("spacemouse", "wrench", "joystick", source=source)
    rig.check("the bridge runs", bridge.wait_error("source:"), bridge.state())
    other = rig.Program("other_puck", ["python3", "-B", f"{setup.project}/tests/kernel/guest/other_puck.py"])
    other.wait_line("ready")
    rig.wait_until(lambda: len(rig.hidraw_nodes()) == 3)
    settle()
    check_opened("the puck's hidraw", nodes.hidraw_node(PUCK))
    check_opened("the wrench sensor's hidraw", nodes.hidraw_node(WRENCH))
    check_closed("the hidraw of another maker's puck", nodes.hidraw_node(FOREIGN))
    for name in ("tagwrench SpaceMouse", "tagwrench joystick"):
        event = nodes.event_node(name)
        rig.check(f"the event node of {name} is for the user at the seat",
                  ":uaccess:" in properties(event).get("CURRENT_TAGS", ""), properties(event))
    bridge.stop()

    with open("/run/own_id.yaml", "w", encoding="utf-8") as file, \
            open(setup.clip("rest") + "/sensor.yaml", encoding="utf-8") as rest:
        file.write(rest.read() + '\nspacemouse: {id: "1209:7a70"}\n')
    bridge = setup.bridge("spacemouse", source=source, sensor="/run/own_id.yaml")
    rig.check("the bridge runs with an id of its user's", bridge.wait_error("source:"), bridge.state())
    rig.wait_until(lambda: nodes.hidraw_node(OWN))
    settle()
    check_opened("the hidraw of an id of one's own, with a line for it", nodes.hidraw_node(OWN))
    check_closed("the other maker's, still", nodes.hidraw_node(FOREIGN))
    bridge.stop()


rig.main(main)
