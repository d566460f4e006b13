"""mouse.py: a mouse, to see that whoever watches for pointer motion would notice it. Moves once for each line on standard
input; prints `ready`, then `moved`."""
import fcntl
import os
import struct
import sys

UI_SET_EVBIT, UI_SET_KEYBIT, UI_SET_RELBIT = 0x40045564, 0x40045565, 0x40045566
UI_DEV_CREATE, UI_DEV_SETUP = 0x5501, 0x405C5503
EV_SYN, EV_KEY, EV_REL, REL_X, REL_Y, BTN_LEFT = 0, 1, 2, 0, 1, 0x110


def main():
    device = os.open("/dev/uinput", os.O_RDWR)
    for request, value in ((UI_SET_EVBIT, EV_KEY), (UI_SET_KEYBIT, BTN_LEFT), (UI_SET_EVBIT, EV_REL),
                           (UI_SET_RELBIT, REL_X), (UI_SET_RELBIT, REL_Y)):
        fcntl.ioctl(device, request, value)
    fcntl.ioctl(device, UI_DEV_SETUP, struct.pack("<HHHH80sI", 3, 0x1209, 1, 1, b"a mouse", 0))
    fcntl.ioctl(device, UI_DEV_CREATE)
    print("ready", flush=True)
    for _ in sys.stdin:
        for kind, code, value in ((EV_REL, REL_X, 5), (EV_SYN, 0, 0)):
            os.write(device, struct.pack("<qqHHi", 0, 0, kind, code, value))
        print("moved", flush=True)


main()
