"""Who is connected to the instrument while it soaks: pages, CAD programs, a reader of lines. Standard library alone."""
import base64
import hashlib
import json
import os
import socket
import struct
import threading
import time


def monotonic_ns():
    return time.clock_gettime_ns(time.CLOCK_MONOTONIC)


class Page(threading.Thread):
    """One page: a WebSocket that asks and answers pings. `reads` False: it never reads again."""

    def __init__(self, port, reads=True):
        super().__init__(daemon=True)
        self.socket = socket.create_connection(("127.0.0.1", port), 10)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall((f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\nConnection: Upgrade\r\n"
                             f"Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
                             "Sec-WebSocket-Protocol: tagwrench.v1\r\n\r\n").encode())
        self.bytes = b""
        while b"\r\n\r\n" not in self.bytes:
            part = self.socket.recv(4096)
            if not part:
                raise ConnectionError("the page was not let in")
            self.bytes += part
        head, self.bytes = self.bytes.split(b"\r\n\r\n", 1)
        accept = base64.b64encode(hashlib.sha1((key + "258EAFA5-E914-47DA-95CA-C5AB0DC85B11").encode()).digest())
        if not head.startswith(b"HTTP/1.1 101") or accept not in head:
            raise ConnectionError(head.split(b"\r\n")[0].decode(errors="replace"))
        self.socket.settimeout(None)
        self.answers, self.samples, self.lost, self.number = {}, 0, 0, 0
        self.changed = threading.Condition()
        if reads:
            self.start()

    def _send(self, kind, payload):
        mask = os.urandom(4)
        size = struct.pack("!B", 0x80 | len(payload)) if len(payload) < 126 else struct.pack("!BH", 0xfe, len(payload))
        self.socket.sendall(bytes([0x80 | kind]) + size + mask + bytes(b ^ mask[i % 4] for i, b in enumerate(payload)))

    def post(self, what, **arguments):
        self.number += 1
        self._send(1, json.dumps({"id": self.number, "ask": what, **arguments}).encode())
        return self.number

    def ask(self, what, patience=10, **arguments):
        """The answer, or None: there was none in time."""
        number = self.post(what, **arguments)
        with self.changed:
            self.changed.wait_for(lambda: number in self.answers, patience)
            return self.answers.pop(number, None)

    def _take(self, count):
        while len(self.bytes) < count:
            part = self.socket.recv(65536)
            if not part:
                raise ConnectionError("closed")
            self.bytes += part
        taken, self.bytes = self.bytes[:count], self.bytes[count:]
        return taken

    def run(self):
        try:
            while True:
                first, size = self._take(2)
                size &= 0x7f
                if size >= 126:
                    size = struct.unpack("!H" if size == 126 else "!Q", self._take(2 if size == 126 else 8))[0]
                payload = self._take(size)
                if first & 15 == 9:
                    self._send(10, payload)
                elif first & 15 == 8:
                    return
                elif first & 15 == 1:
                    self._heard(json.loads(payload))
        except (OSError, ValueError):
            pass

    def _heard(self, message):
        with self.changed:
            if message.get("type") == "answer":
                self.answers[message["id"]] = message
                self.changed.notify_all()
            elif message.get("type") == "samples":
                self.samples += len(message["samples"])
                self.lost += message.get("lost", 0)

    def close(self):
        self.socket.close()


class CadProgram(threading.Thread):
    """A program at the spnav socket, in version 0 of its protocol: 32 bytes an event, the first word 0 for motion. Remembers the
    last motion and when it became zero."""

    def __init__(self, path, reads=True):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.connect(path)
        self.motion, self.zero_at, self.events = [0] * 6, monotonic_ns(), 0
        self.changed = threading.Condition()
        self.closed = False
        if reads:
            self.start()

    def run(self):
        left = b""
        while part := self._read():
            left += part
            while len(left) >= 32:
                words, left = struct.unpack("=8i", left[:32]), left[32:]
                if words[0] != 0:
                    continue
                with self.changed:
                    self.events += 1
                    self.motion = list(words[1:7])
                    if not any(self.motion):
                        self.zero_at = monotonic_ns()
                    self.changed.notify_all()
        with self.changed:
            self.closed = True
            self.changed.notify_all()

    def _read(self):
        try:
            return self.socket.recv(4096)
        except OSError:
            return b""

    def wait_moving(self, patience):
        with self.changed:
            return self.changed.wait_for(lambda: any(self.motion), patience)

    def wait_zero(self, since_ns, patience):
        """Milliseconds from `since_ns` to the zero that lasts; None: it did not come."""
        with self.changed:
            if not self.changed.wait_for(lambda: not any(self.motion), patience):
                return None
            return max(0, self.zero_at - since_ns) / 1e6

    def close(self):
        self.socket.close()


class Lines(threading.Thread):
    """Reads the samples that the program prints, and keeps account of them."""

    def __init__(self, stream):
        super().__init__(daemon=True)
        self.stream = stream
        self.samples = self.dropped = 0
        self.latencies_us, self.statuses = [], {}
        self.last, self.said = None, 0  # number of the last sample that had one; what was said to be lost since
        self.gaps = []  # (ns, number before, number after, said to be lost between them)
        self.last_ns = monotonic_ns()
        self.start()

    def run(self):
        for line in self.stream:
            try:
                sample = json.loads(line)
            except ValueError:
                continue  # cut short by a kill
            self.samples += 1
            self.last_ns = monotonic_ns()
            self.dropped += sample["dropped"]
            self.said += sample["dropped"]
            if self.last is None or sample["seq"] > self.last:  # else there was no picture in time
                if self.last is not None and sample["seq"] - self.last - 1 > self.said:
                    self.gaps.append((self.last_ns, self.last, sample["seq"], self.said))
                self.last, self.said = sample["seq"], 0
            self.latencies_us.append(sample["latency_us"])
            self.statuses[sample["status"]] = self.statuses.get(sample["status"], 0) + 1
