"""A page of the bridge as a browser would have it, over a WebSocket (RFC 6455) by hand: the guest has no library for that."""
import base64
import json
import os
import socket

PORT = 8137
TEXT, PING, PONG = 1, 9, 10


class Page:
    def __init__(self, port=PORT, patience=60):
        self._socket = socket.create_connection(("127.0.0.1", port), timeout=patience)
        key = base64.b64encode(os.urandom(16)).decode()
        self._socket.sendall((f"GET /ws HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nOrigin: http://127.0.0.1:{port}\r\n"
                              f"Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
                              "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: tagwrench.v1\r\n\r\n").encode())
        self._file = self._socket.makefile("rb")
        self.answered = self._file.readline().decode().strip()
        while self._file.readline() not in (b"\r\n", b""):
            pass
        self._asked = 0

    def _send(self, opcode, payload):
        mask = os.urandom(4)
        size = len(payload)
        head = bytes([0x80 | opcode, 0x80 | size]) if size < 126 else bytes([0x80 | opcode, 0xFE]) + size.to_bytes(2, "big")
        self._socket.sendall(head + mask + bytes(byte ^ mask[i % 4] for i, byte in enumerate(payload)))

    def _receive(self):
        """Opcode and payload of the next frame; the bridge sends none in pieces."""
        first, second = self._file.read(2)
        size = second & 0x7F
        if size >= 126:
            size = int.from_bytes(self._file.read(2 if size == 126 else 8), "big")
        return first & 15, self._file.read(size)

    def next(self, wanted):
        """The next message that is as wanted; raises TimeoutError if none comes."""
        while True:
            opcode, payload = self._receive()
            if opcode == PING:
                self._send(PONG, payload)
            if opcode == TEXT:
                message = json.loads(payload)
                if wanted(message):
                    return message

    def ask(self, what, **arguments):
        """The answer to a wish."""
        self._asked += 1
        self._send(TEXT, json.dumps({"id": self._asked, "ask": what, **arguments}).encode())
        return self.next(lambda message: message["type"] == "answer" and message["id"] == self._asked)
