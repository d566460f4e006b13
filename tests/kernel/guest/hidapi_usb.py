"""hidapi_usb.py VID:PID: hidapi over libusb (Debian's python3-hid), a line `in TIME_ns HEX` for every report."""
import sys
import time

import hid

vendor, product = (int(word, 16) for word in sys.argv[1].split(":"))
device = hid.device()
while True:
    try:
        device.open(vendor, product)
        break
    except OSError:
        time.sleep(0.02)
print("device", "|".join((device.get_manufacturer_string(), device.get_product_string(),
                          device.get_serial_number_string())), flush=True)
while True:
    report = bytes(device.read(64, 1000))
    if report:
        print("in", time.clock_gettime_ns(time.CLOCK_MONOTONIC), report.hex(), flush=True)
