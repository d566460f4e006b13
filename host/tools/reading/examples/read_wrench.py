#!/usr/bin/env python3
"""Prints what a tagwrench wrench sensor feels, in newtons and newton metres.

    sudo apt install python3-hid
    ./read_wrench.py [SERIAL] [SAMPLES]

SERIAL "-" is the first sensor; without SAMPLES it goes on until the sensor is gone or Ctrl-C.
Columns: sequence, status, Fx Fy Fz in N, Mx My Mz in N m, age of the sample in ms.

To use it from a program of your own: `import read_wrench`, then open_sensor() and samples().
"""
import collections
import struct
import sys
import time

try:
    import hidraw as hid  # Debian's python3-hid: its module `hid` goes through libusb, which sees no virtual device
except ImportError:
    import hid  # the same package from elsewhere may have one module only

VENDOR, PRODUCT = 0x1209, 0x7A6E
STATUS = ("ok", "acquiring", "lost", "doubtful", "saturated")
# Little-endian: report id, forces and torques (1e-6 N, N m), their sigmas, capture time in s and us, sequence, frames
# lost, status.
REPORT = struct.Struct("<B6i6I3IHB")
REPORT_ID = 0x20
RANGE = 2**31 - 1

Sample = collections.namedtuple(
    "Sample", "force_n torque_nm force_sigma_n torque_sigma_nm capture_time_ns sequence lost status has_numbers")


def decode(report):
    """A Sample of the 64 bytes of one input report; None if they are something else.

    Force and torque are what the user applies to the platform, about the wrench origin, along the axes of the sensor's
    wrench frame. capture_time_ns is on CLOCK_MONOTONIC (time.monotonic_ns()) of the computer with the camera. Numbers
    are zero and mean nothing unless has_numbers.
    """
    if len(report) != REPORT.size or report[0] != REPORT_ID:
        return None
    _, *counts, seconds, microseconds, sequence, lost, status = REPORT.unpack(bytes(report))
    in_range = (all(-RANGE <= count <= RANGE for count in counts) and seconds <= RANGE and microseconds < 1_000_000
                and sequence <= RANGE and status < len(STATUS))
    if not in_range:
        return None
    name = STATUS[status]
    has_numbers = name in ("ok", "saturated")
    si = [count / 1e6 if has_numbers else 0.0 for count in counts]
    return Sample(si[0:3], si[3:6], si[6:9], si[9:12], seconds * 1_000_000_000 + microseconds * 1000, sequence, lost, name,
                  has_numbers)


def find_sensor(serial=None):
    """What hidapi says of the sensor with this serial, or of the first one. Raises OSError."""
    found = hid.enumerate(VENDOR, PRODUCT)
    wanted = [d for d in found if serial in (None, d["serial_number"])]
    if not wanted:
        there = ", ".join(d["serial_number"] for d in found)
        raise OSError(f"no wrench sensor with serial {serial}; there is: {there}" if there else
                      "no wrench sensor is here; start one: tagwrench run --output wrench")
    return wanted[0]


def open_sensor(serial=None):
    """The sensor with this serial, or the first one. Raises OSError."""
    path = find_sensor(serial)["path"]
    device = hid.device()
    try:
        device.open_path(path)
    except OSError as error:
        raise OSError(f"{path.decode()}: does not open; without permission install 70-tagwrench.rules in "
                      "/etc/udev/rules.d") from error
    return device


def samples(device, timeout_ms=1000):
    """Yields each Sample, and None when there was no report for `timeout_ms`. Raises OSError when the device is gone."""
    while True:
        report = device.read(REPORT.size + 1, timeout_ms)
        sample = decode(report)
        if sample is not None or not report:
            yield sample


def main(arguments):
    serial = arguments[0] if arguments and arguments[0] != "-" else None
    left = int(arguments[1]) if len(arguments) > 1 else -1
    try:
        device = open_sensor(serial)
    except OSError as error:
        print(error, file=sys.stderr)
        return 2
    try:
        for sample in samples(device):
            if left == 0:
                break
            if sample is None:
                continue
            age_ms = (time.monotonic_ns() - sample.capture_time_ns) / 1e6
            values = " ".join(f"{value:.6f}" for value in sample.force_n + sample.torque_nm)
            print(f"{sample.sequence} {sample.status} {values} {age_ms:.1f}", flush=True)
            left -= 1
    except OSError:
        print("the sensor is gone: unplugged, or the bridge has ended", file=sys.stderr)
        return 1
    finally:
        device.close()
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main(sys.argv[1:]))
    except KeyboardInterrupt:
        sys.exit(0)
