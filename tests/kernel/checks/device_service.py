"""The service of devices: an ordinary user has them made and cannot type. Who may not gets nothing, and nobody gets a keyboard,
another's puck, or reports that tagwrench would not write."""
import os
import select
import signal
import socket
import struct

import nodes
import rig
from pushes import PUSHES, check_axis, six, wait_for_zero

USER = "1500"  # no such account is needed
PUCK = "0003:0000256F:0000C62E"
CREATE2, DESTROY, START, INPUT2 = 11, 1, 2, 12
EVENT_SIZE = 4380  # struct uhid_event
KEYBOARD = bytes.fromhex("05010906a1018501050719e029e71500250175019508810275089506150025650507190029658100c0")


def creation(name=b"tagwrench SpaceMouse", serial=b"tagwrench-0", vendor=0x256F, product=0xC62E, bus=3, descriptor=b""):
    return struct.pack("<I128s64s64sHHIIII4096s", CREATE2, name, b"tagwrench", serial, len(descriptor), bus, vendor, product,
                       0x100, 0, descriptor) + bytes(4)


def report(data):
    return struct.pack("<IH", INPUT2, len(data)) + data


def connect(node):
    """As root, whom the service serves, so that its own judgement of the bytes is all that stands between."""
    client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    client.connect(f"/run/tagwrench-devices/{node}")
    client.settimeout(rig.PATIENCE)
    rig.check(f"the service lends {node} to root", client.recv(4) == bytes(4))
    return client


def hung_up(client):
    """The service has closed the connection; what it said before is of no interest."""
    poll = select.poll()
    poll.register(client, select.POLLHUP)
    if not poll.poll(1000 * rig.PATIENCE):
        return False
    client.close()
    return True


def descriptor_of_puck():
    with open(f"/sys/class/hidraw/{os.path.basename(nodes.hidraw_node(PUCK))}/device/report_descriptor", "rb") as file:
        return file.read()


def check_hostile(descriptor):
    """Nothing of this is made, and the connection ends."""
    before = rig.our_devices(), len(rig.hidraw_nodes())
    for what, event in (
            ("a keyboard", creation(descriptor=KEYBOARD)),
            ("a keyboard behind our descriptor", creation(descriptor=descriptor + KEYBOARD)),
            ("a keyboard behind the length of our descriptor", creation(descriptor=descriptor)[:280 + len(descriptor)]
             + KEYBOARD + bytes(EVENT_SIZE - 280 - len(descriptor) - len(KEYBOARD))),
            ("a puck of somebody's name", creation(name=b"3Dconnexion SpaceMouse", descriptor=descriptor)),
            ("a puck whose serial number is no name", creation(serial=b"tagwrench-\xc2\x9b", descriptor=descriptor)),
            ("a puck of no sensor's serial number", creation(serial=b"0", descriptor=descriptor)),
            ("a puck of a keyboard's id", creation(vendor=0x046D, product=0xC31C, descriptor=descriptor)),
            ("a puck of an id that is cut off to ours", creation(vendor=0x1256F, descriptor=descriptor)),
            ("a puck of another bus", creation(bus=5, descriptor=descriptor)),
            ("a report of no device", report(bytes([1]) + bytes(12))),
            ("a short event", b"\x0b\0\0\0"),
            ("an event that is too long", creation(descriptor=descriptor) + b"x"),
            ("an event that is too short", creation(descriptor=descriptor)[:-4]),
            ("the event of old kernels (UHID_CREATE)", bytes(EVENT_SIZE))):
        client = connect("uhid")
        client.send(event)
        rig.check(f"{what} is refused", hung_up(client))
    client = connect("uinput")
    client.send(struct.pack("<HHHH80sI", 3, 0x1209, 0x7A6F, 0x100, b"keyboard", 0))
    rig.check("a uinput device of another name is refused", client.recv(4) != bytes(4) and hung_up(client))
    rig.check("none of them was made", (rig.our_devices(), len(rig.hidraw_nodes())) == before, rig.our_devices())


def check_reports(descriptor):
    """A device of ours in a stranger's hands: what is no report of it ends it, and so does its end."""
    def made(serial):
        client = connect("uhid")
        client.send(creation(serial=serial, descriptor=descriptor))
        while struct.unpack_from("<I", client.recv(EVENT_SIZE))[0] != START:
            pass
        return client
    for what, event in (("a second device", creation(descriptor=KEYBOARD)),
                        ("a report that claims more than it has", struct.pack("<IH", INPUT2, 64) + bytes(13)),
                        ("a report of 65 bytes", report(bytes(65))),
                        ("UHID_START", struct.pack("<I", START))):
        client = made(b"tagwrench-test")
        client.send(report(bytes([1]) + struct.pack("<6h", 350, 0, 0, 0, 0, 0)))
        client.send(event)
        rig.check(f"a device is made; {what} ends it", hung_up(client))
    client = made(b"tagwrench-test")
    with open("/dev/null", "rb") as file:  # of a kind whose closing takes its time, a stranger would choose
        socket.send_fds(client, [report(bytes([1]) + bytes(12))], [file.fileno()] * 3)
    rig.check("files that come along with a report end it", hung_up(client))
    client = made(b"tagwrench-test")
    client.send(struct.pack("<I", DESTROY))
    rig.check("after a device's end nothing more is taken", hung_up(client))
    stick = connect("uinput")
    stick.send(struct.pack("<HHHH80sI", 3, 0x1209, 0x7A6F, 0x100, b"tagwrench joystick test", 0))
    rig.check("a joystick is made", stick.recv(4) == bytes(4) and rig.wait_until(lambda: nodes.event_node("tagwrench joystick test")))
    stick.send(struct.pack("<qqHHi", 0, 0, 1, 30, 1) * 15)  # KEY_A
    rig.check("a joystick's key that it has not got ends it", hung_up(stick))
    rig.check("all of them are gone", rig.wait_until(lambda: not rig.input_devices("joystick test") and len(rig.hidraw_nodes()) == 2),
              rig.our_devices())


def check_who(setup, outputs):
    refused = rig.Program("tagwrench", [*rig.as_user("1501", "input,video"), setup.tagwrench, "run", "--source", "sim", *outputs])
    status = refused.wait()
    rig.check("who neither sits here nor is in the group gets no device, and is told which group",
              status == 2 and len(refused.err) == 1 and "usermod -aG tagwrench" in refused.err[0], refused.state())
    for node in ("/dev/uhid", "/dev/uinput"):
        status, _, _ = rig.run(*rig.as_user(USER), "test", "-w", node)
        rig.check(f"a member of the group cannot open {node}", status != 0)


def main(setup):
    rig.load("uhid", "hid-generic", "uinput", "evdev", "joydev", "v4l2loopback video_nr=0 exclusive_caps=1")
    daemon = rig.start_spacenavd()
    feeder = setup.feeder(["rest", "push_fx", "held_fz"])
    feeder.tell("loop rest")
    rig.start_udevd(setup.project + "/host/output/70-tagwrench.rules")
    no_service = setup.bridge("spacemouse", user=USER)
    rig.check("without the service status 2 and one line that names node and package",
              no_service.wait() == 2 and len(no_service.err) == 1 and "/dev/uhid" in no_service.err[0] and "package" in no_service.err[0],
              no_service.state())
    rig.serve_devices(os.path.join(os.path.dirname(setup.tagwrench), "output/tagwrench-devices"))
    check_who(setup, ["--output", "spacemouse"])

    outputs = "spacemouse", "wrench", "joystick"
    bridge = setup.bridge(*outputs, user=USER)
    rig.check("a member's bridge runs", bridge.wait_error("rest pose learned"), bridge.state())
    rig.check_taken(daemon)
    rig.check("the LED that spacenavd lights arrives", bridge.wait_error("LED on"), bridge.state())
    spnav = setup.client("spnav_client", user=USER)
    spnav.wait_line("connected")
    sdl = setup.client("sdl_client", "tagwrench joystick", user=USER, env={"SDL_VIDEODRIVER": "dummy"})
    sdl.wait_line("joystick")
    name, marks = "push_fx", (len(feeder.out), len(spnav.out), len(sdl.out))
    feeder.tell(f"once {name}")
    feeder.wait_line(f"done {name}", marks[0])
    _, (hid_axis, _), (axis, sign) = PUSHES[name]
    rig.check("release is exactly zero", wait_for_zero(spnav, marks[1]), spnav.out[-1:])
    check_axis("libspnav", name, six(spnav.out[marks[1]:], "motion", 1), axis, sign, 100)
    rig.check("SDL sees the axis move",
              any(line.startswith("axis ") and line.split()[2] == str(hid_axis) for line in sdl.out[marks[2]:]), sdl.state())

    descriptor = descriptor_of_puck()
    check_hostile(descriptor)
    check_reports(descriptor)
    rig.check("the bridge did not mind", bridge.running(), bridge.state())

    mark = len(spnav.out)
    feeder.tell("hold held_fz")
    rig.wait_until(lambda: any(map(any, six(spnav.out[mark:], "motion", 1))))
    mark = len(spnav.out)
    os.kill(bridge.pid, signal.SIGSTOP)
    rig.check("a bridge that is stopped leaves the puck at rest", wait_for_zero(spnav, mark), spnav.out[-1:])
    os.kill(bridge.pid, signal.SIGCONT)
    mark = len(spnav.out)
    rig.check("and goes on", rig.wait_until(lambda: any(map(any, six(spnav.out[mark:], "motion", 1)))), bridge.state())
    mark = len(spnav.out)
    for process in rig.processes("tw-watchdog"):
        os.kill(int(process.split("(")[1].rstrip(")")), signal.SIGKILL)
    os.kill(bridge.pid, signal.SIGKILL)
    bridge.wait()
    rig.check("kill -9 of the bridge and its watchdog: the service brings the puck to rest", wait_for_zero(spnav, mark), spnav.out[-1:])
    rig.check("no device is left behind", rig.wait_until(lambda: not rig.our_devices()), rig.our_devices())
    rig.check("no process of the service either", rig.wait_until(lambda: not rig.processes("tagwrench-devic")), rig.processes("tagwrench"))

    bridge = setup.bridge(*outputs, user=USER)
    rig.check("a member's bridge runs again", bridge.wait_error("rest pose learned"), bridge.state())
    for process in rig.processes("tagwrench-devic"):
        os.kill(int(process.split("(")[1].rstrip(")")), signal.SIGTERM)
    rig.check("a service that ends takes its devices with it", rig.wait_until(lambda: not rig.our_devices()), rig.our_devices())
    rig.check("and the bridge says so", bridge.wait_error("the service of devices has ended"), bridge.state())
    bridge.stop()


rig.main(main)
