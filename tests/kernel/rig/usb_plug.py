"""usb_plug.py FOLDER: the hand that pulls the guest's USB serial adapter out and plugs it in again, when the guest makes
FOLDER/usb-unplug or FOLDER/usb-plug. Speaks QEMU's QMP on FOLDER/qmp; ends with QEMU."""
import json
import os
import socket
import sys
import time


def connect(path):
    while True:
        try:
            connection = socket.socket(socket.AF_UNIX)
            connection.connect(path)
            return connection.makefile("rw", encoding="utf-8")
        except OSError:
            time.sleep(0.1)


def ask(stream, command, **arguments):
    """QEMU's answer; events that come before it are skipped."""
    stream.write(json.dumps({"execute": command, "arguments": arguments}) + "\n")
    stream.flush()
    for line in stream:
        reply = json.loads(line)
        if "return" in reply or "error" in reply:
            return reply
    sys.exit(0)


def main(folder):
    stream = connect(f"{folder}/qmp")
    stream.readline()  # its greeting
    ask(stream, "qmp_capabilities")
    while True:
        for wish, command, arguments in (
                ("usb-unplug", "device_del", {"id": "plug"}),
                ("usb-plug", "device_add", {"driver": "usb-serial", "chardev": "adapter", "bus": "usb.0", "port": "1",
                                           "serial": "bench", "id": "plug"})):
            path = f"{folder}/{wish}"
            if not os.path.exists(path) or os.path.getsize(path) == 0:  # the guest is still opening it
                continue
            reply = ask(stream, command, **arguments)
            if "error" in reply:  # the device that leaves is not quite gone yet
                time.sleep(0.1)
            else:
                os.remove(path)
        ask(stream, "query-status")  # ends with QEMU
        time.sleep(0.05)


try:
    main(sys.argv[1])
except (BrokenPipeError, ConnectionResetError):
    pass  # QEMU has ended
