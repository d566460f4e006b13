"""What a program without libraries gets out of the kernel's nodes: evdev, joydev, hidraw."""
import fcntl
import glob
import os
import struct
import threading

ABS_NAMES = ("ABS_X", "ABS_Y", "ABS_Z", "ABS_RX", "ABS_RY", "ABS_RZ")
EV_KEY, EV_REL, EV_ABS = 1, 2, 3
JS_AXIS, JS_INIT = 2, 0x80


def _read(size, letter, number):
    return 2 << 30 | size << 16 | ord(letter) << 8 | number


def _text(fd, letter, number):
    return fcntl.ioctl(fd, _read(256, letter, number), bytes(256)).split(b"\0")[0].decode()


def bits(fd, event_type, size=96):
    """The codes of an event type that the node has (EVIOCGBIT); of type 0 its event types."""
    mask = fcntl.ioctl(fd, _read(size, "E", 0x20 + event_type), bytes(size))
    return {8 * i + bit for i, byte in enumerate(mask) for bit in range(8) if byte >> bit & 1}


def absolute(fd, code):
    """(value, least, most, fuzz, flat, resolution) of an axis (EVIOCGABS)."""
    return struct.unpack("<6i", fcntl.ioctl(fd, _read(24, "E", 0x40 + code), bytes(24)))


def find(pattern, letter, number, name):
    """The path of the node whose name (EVIOCGNAME, JSIOCGNAME) is this, or None."""
    for path in sorted(glob.glob(pattern)):
        fd = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        try:
            if _text(fd, letter, number) == name:
                return path
        finally:
            os.close(fd)
    return None


def event_node(name):
    return find("/dev/input/event*", "E", 0x06, name)


def joystick_node(name):
    return find("/dev/input/js*", "j", 0x13, name)


def hidraw_node(identity):
    """Of a device by bus:vendor:product as HID_ID has it, e.g. 0003:0000256F:0000C62E."""
    for path in glob.glob("/sys/class/hidraw/hidraw*"):
        with open(path + "/device/uevent", encoding="utf-8") as file:
            if f"HID_ID={identity}" in file.read():
                return "/dev/" + os.path.basename(path)
    return None


class Reader:
    """Reads records of one node for as long as the check runs."""

    def __init__(self, path, layout):
        self.path, self.layout = path, struct.Struct(layout)
        self.fd = os.open(path, os.O_RDONLY)
        self.records = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        try:
            while data := os.read(self.fd, 64 * self.layout.size):
                self.records += self.layout.iter_unpack(data)
        except OSError:
            pass  # the device is gone


class Evdev(Reader):
    def __init__(self, path):
        super().__init__(path, "<qqHHi")

    def axes(self, since=0):
        """(code, value) of every EV_ABS since a mark."""
        return [record[3:] for record in self.records[since:] if record[2] == EV_ABS]

    def relative(self):
        return [record for record in self.records if record[2] == EV_REL]


class Joydev(Reader):
    """/dev/input/jsN, as jstest and old games read it."""

    def __init__(self, path):
        super().__init__(path, "<IhBB")

    def count(self, number):
        """JSIOCGAXES is 0x11, JSIOCGBUTTONS 0x12."""
        return fcntl.ioctl(self.fd, _read(1, "j", number), bytes(1))[0]

    def initial(self):
        return [record for record in self.records if record[2] & JS_INIT]

    def axes(self, since=0):
        return [(record[3], record[1]) for record in self.records[since:] if record[2] == JS_AXIS]
