// The least of RFC 6455 that a fake bridge needs: whole frames, no extensions.
import { createHash } from 'node:crypto';

const kMagic = '258EAFA5-E914-47DA-95CA-C5AB0DC85B11';

function frame(opcode, payload) {
  const head = [0x80 | opcode];
  if (payload.length < 126) head.push(payload.length);
  else if (payload.length < 65536) head.push(126, payload.length >> 8, payload.length & 255);
  else head.push(127, 0, 0, 0, 0, ...[24, 16, 8, 0].map((shift) => (payload.length >>> shift) & 255));
  return Buffer.concat([Buffer.from(head), payload]);
}

export class ServedSocket {
  #socket;
  #unread = Buffer.alloc(0);

  constructor(request, socket, protocol) {
    this.#socket = socket;
    const accept = createHash('sha1')
      .update(request.headers['sec-websocket-key'] + kMagic)
      .digest('base64');
    const lines = [
      'HTTP/1.1 101 Switching Protocols',
      'Upgrade: websocket',
      'Connection: Upgrade',
      `Sec-WebSocket-Accept: ${accept}`,
    ];
    if (protocol) lines.push(`Sec-WebSocket-Protocol: ${protocol}`);
    socket.write(`${lines.join('\r\n')}\r\n\r\n`);
    socket.on('data', (bytes) => this.#read(bytes));
    socket.on('error', () => {});
    socket.on('close', () => this.onclose?.());
  }

  /** onmessage(text), onclose() */
  send(data) {
    if (this.#socket.destroyed) return;
    this.#socket.write(typeof data === 'string' ? frame(1, Buffer.from(data)) : frame(2, data));
  }

  close(code = 1000) {
    if (this.#socket.destroyed) return;
    this.#socket.end(frame(8, Buffer.from([code >> 8, code & 255])));
  }

  cut() {
    this.#socket.destroy();
  }

  #read(bytes) {
    this.#unread = Buffer.concat([this.#unread, bytes]);
    for (;;) {
      const all = this.#unread;
      if (all.length < 2) return;
      let length = all[1] & 127;
      let at = 2;
      if (length === 126) {
        if (all.length < 4) return;
        length = all.readUInt16BE(2);
        at = 4;
      } else if (length === 127) {
        if (all.length < 10) return;
        length = Number(all.readBigUInt64BE(2));
        at = 10;
      }
      const end = at + 4 + length;
      if (all.length < end) return;
      const mask = all.subarray(at, at + 4);
      const payload = Buffer.from(all.subarray(at + 4, end)).map((byte, i) => byte ^ mask[i & 3]);
      this.#unread = all.subarray(end);
      const opcode = all[0] & 15;
      if (opcode === 8) return this.#socket.end(frame(8, payload.subarray(0, 2)));
      if (opcode === 9) this.#socket.write(frame(10, payload));
      if (opcode === 1) this.onmessage?.(payload.toString());
    }
  }
}
