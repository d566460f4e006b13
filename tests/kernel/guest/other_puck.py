"""other_puck.py: another SpaceMouse, a 256f:c635 "Compact" as the kernel sees a real one: six axes of +-350 in two reports,
two buttons, an LED. Lives until it is killed; prints `ready`. `move X Y Z RX RY RZ` on standard input sends both reports."""
import os
import struct
import sys
import threading

CREATE2, INPUT2, START = 11, 12, 2
BUS_USB, VENDOR, PRODUCT = 3, 0x256F, 0xC635
EVENT_SIZE = 4380  # struct uhid_event: a type and the largest of its requests

AXES = "16a2fe265e01751095038102"  # -350..350, three of 16 bits, absolute
DESCRIPTOR = bytes.fromhex(
    "05010908a101"
    "a1008501" + "093009310932" + AXES + "c0"
    "a1008502" + "093309340935" + AXES + "c0"
    "a1028503" "050919012902" "15002501" "75019502" "8102" "750195068103" "c0"
    "a1028504" "0508094b" "15002501" "75019501" "9102" "750195079103" "c0"
    "c0")


def create(uhid):
    request = struct.pack("<I128s64s64sHHIIII4096s", CREATE2, b"3Dconnexion SpaceMouse Compact", b"", b"another-one",
                          len(DESCRIPTOR), BUS_USB, VENDOR, PRODUCT, 0, 0, DESCRIPTOR)
    os.write(uhid, request)
    while struct.unpack_from("<I", os.read(uhid, EVENT_SIZE))[0] != START:
        pass


def drain(uhid):
    """What the kernel asks is of no interest, but must be taken."""
    while os.read(uhid, EVENT_SIZE):
        pass


def send(uhid, report, values):
    data = struct.pack("<B3h", report, *values)
    os.write(uhid, struct.pack("<IH4096s", INPUT2, len(data), data))


def main():
    uhid = os.open("/dev/uhid", os.O_RDWR)
    create(uhid)
    threading.Thread(target=drain, args=(uhid,), daemon=True).start()
    print("ready", flush=True)
    for line in sys.stdin:
        words = line.split()
        if words[:1] != ["move"] or len(words) != 7:
            sys.exit(f"cannot do: {line}")
        counts = [int(word) for word in words[1:]]
        send(uhid, 1, counts[:3])
        send(uhid, 2, counts[3:])


main()
