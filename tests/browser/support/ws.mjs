// A WebSocket client (RFC 6455) for node, whose own one is an experiment in version 20. It can also do what no browser does:
// send broken frames, leave out headers, or never read.
//
//   const page = await WsPage.connect(port);               // as a page of http://127.0.0.1:port would
//   const hello = await page.next((m) => m.type === 'hello');
//   const answer = await page.ask('zero');                 // {type: 'answer', id, ok, text, data}
//   page.picture                                           // the last binary message: {header, jpeg}
//   page.close(); await page.closed;                       // {code, reason}
import { createHash, randomBytes } from 'node:crypto';
import net from 'node:net';

const MAGIC = '258EAFA5-E914-47DA-95CA-C5AB0DC85B11';
export const TEXT = 1;
export const BINARY = 2;
export const CLOSE = 8;
export const PING = 9;
export const PONG = 10;

/** One frame as a client sends it; `masked: false` and `reserved` break the rules on purpose. */
export function frame(opcode, payload, { final = true, masked = true, reserved = 0 } = {}) {
  const body = Buffer.from(payload);
  const head = [(final ? 0x80 : 0) | (reserved << 4) | opcode];
  const mark = masked ? 0x80 : 0;
  if (body.length < 126) head.push(mark | body.length);
  else if (body.length < 65536) head.push(mark | 126, body.length >> 8, body.length & 255);
  else {
    const size = Buffer.alloc(8);
    size.writeBigUInt64BE(BigInt(body.length));
    head.push(mark | 127, ...size);
  }
  if (!masked) return Buffer.concat([Buffer.from(head), body]);
  const mask = randomBytes(4);
  return Buffer.concat([Buffer.from(head), mask, body.map((byte, i) => byte ^ mask[i & 3])]);
}

/** The first whole frame in `bytes`, and where it ends; null: there is none yet. */
export function parseFrame(bytes) {
  if (bytes.length < 2) return null;
  let size = bytes[1] & 0x7f;
  let at = 2;
  if (size === 126) {
    if (bytes.length < 4) return null;
    size = bytes.readUInt16BE(2);
    at = 4;
  } else if (size === 127) {
    if (bytes.length < 10) return null;
    size = Number(bytes.readBigUInt64BE(2));
    at = 10;
  }
  if (bytes.length < at + size) return null;
  return { opcode: bytes[0] & 15, final: bytes[0] >= 128, payload: bytes.subarray(at, at + size), end: at + size };
}

/** Sends `text` to the port and gives all that comes back until the other side closes. */
export function rawExchange(port, text, { host = '127.0.0.1', half = true } = {}) {
  return new Promise((resolve, reject) => {
    const parts = [];
    const socket = net.connect(port, host, () => (half ? socket.end(text) : socket.write(text)));
    socket.on('data', (part) => parts.push(part));
    socket.on('close', () => resolve(Buffer.concat(parts).toString('latin1')));
    socket.on('error', (error) => (parts.length > 0 ? undefined : reject(error)));
  });
}

export class WsRefused extends Error {
  constructor(response) {
    super(response.split('\r\n', 1)[0]);
    this.response = response;
    this.status = Number(response.split(' ', 2)[1]);
  }
}

export class WsPage {
  #socket;
  #bytes = Buffer.alloc(0);
  #parts = [];
  #waiting = [];
  #lastId = 0;
  #closing = null;

  messages = []; // JSON messages that nobody has waited for
  picture = null;
  pictures = 0;
  received = 0; // messages of all kinds
  answersPings = true;

  /** Options: token, origin and host (null: left out), protocols, headers (array of lines), target. */
  static async connect(port, options = {}) {
    const page = new WsPage();
    await page.#open(port, options);
    return page;
  }

  #open(port, options) {
    const host = options.host ?? `127.0.0.1:${port}`;
    const origin = options.origin === undefined ? `http://${host}` : options.origin;
    const protocols = options.protocols ?? ['tagwrench.v1'];
    const offered = [...protocols];
    if (options.token) offered.push(`tagwrench.token.${Buffer.from(options.token).toString('base64url')}`);
    const key = randomBytes(16).toString('base64');
    const lines = [
      `GET ${options.target ?? '/ws'} HTTP/1.1`,
      `Host: ${host}`,
      'Connection: Upgrade',
      'Upgrade: websocket',
      'Sec-WebSocket-Version: 13',
      `Sec-WebSocket-Key: ${key}`,
      ...(origin === null ? [] : [`Origin: ${origin}`]),
      ...(offered.length === 0 ? [] : [`Sec-WebSocket-Protocol: ${offered.join(', ')}`]),
      ...(options.headers ?? []),
    ];
    this.closed = new Promise((resolve) => (this.#closing = resolve));
    return new Promise((resolve, reject) => {
      this.#socket = net.connect(port, options.address ?? '127.0.0.1', () =>
        this.#socket.write(`${lines.join('\r\n')}\r\n\r\n`),
      );
      this.#socket.setNoDelay(true);
      let open = false;
      this.#socket.on('data', (part) => {
        this.#bytes = Buffer.concat([this.#bytes, part]);
        if (!open) {
          const end = this.#bytes.indexOf('\r\n\r\n');
          if (end < 0) return;
          const head = this.#bytes.subarray(0, end).toString('latin1');
          if (!head.startsWith('HTTP/1.1 101 ')) return; // refused: what comes is collected until the end
          const accept = createHash('sha1').update(key + MAGIC).digest('base64');
          if (!head.includes(accept)) return this.#socket.destroy(new Error('wrong Sec-WebSocket-Accept'));
          open = true;
          this.protocol = /sec-websocket-protocol: *(\S+)/i.exec(head)?.[1] ?? '';
          this.#bytes = this.#bytes.subarray(end + 4);
          resolve();
        }
        this.#takeFrames();
      });
      this.#socket.on('error', (error) => (open ? undefined : reject(error)));
      this.#socket.on('close', () => {
        if (!open) reject(new WsRefused(this.#bytes.toString('latin1')));
        this.#end({ code: 1006, reason: 'cut off' });
      });
    });
  }

  #takeFrames() {
    for (let one = parseFrame(this.#bytes); one !== null; one = parseFrame(this.#bytes)) {
      this.#bytes = this.#bytes.subarray(one.end);
      this.#takeFrame(one);
    }
  }

  #takeFrame({ opcode, final, payload }) {
    if (opcode === PING && this.answersPings) this.sendFrame(PONG, payload);
    if (opcode === CLOSE) {
      const code = payload.length >= 2 ? payload.readUInt16BE(0) : 1005;
      this.#socket.end(frame(CLOSE, payload.subarray(0, 2)));
      this.#end({ code, reason: payload.subarray(2).toString() });
    }
    if (opcode >= 8) return;
    if (opcode !== 0) this.#parts = [opcode];
    this.#parts.push(Buffer.from(payload));
    if (!final) return;
    const [kind, ...parts] = this.#parts;
    this.received += 1;
    if (kind === BINARY) this.#takePicture(Buffer.concat(parts));
    else this.#takeMessage(JSON.parse(Buffer.concat(parts).toString()));
  }

  #takePicture(bytes) {
    const size = bytes.readUInt32LE(0);
    this.picture = { header: JSON.parse(bytes.subarray(4, 4 + size).toString()), jpeg: bytes.subarray(4 + size) };
    this.pictures += 1;
    this.#takeMessage({ type: 'picture', header: this.picture.header });
  }

  #takeMessage(message) {
    const index = this.#waiting.findIndex((one) => one.wanted(message));
    if (index >= 0) this.#waiting.splice(index, 1)[0].resolve(message);
    else if (this.messages.push(message) > 1000) this.messages.shift();
  }

  #end(how) {
    this.#closing?.(how);
    for (const one of this.#waiting.splice(0)) one.reject(new Error(`closed: ${how.code} ${how.reason}`));
  }

  /** The first message that fits, come already or to come; it is taken out of `messages`. */
  next(wanted = () => true) {
    const index = this.messages.findIndex(wanted);
    if (index >= 0) return Promise.resolve(this.messages.splice(index, 1)[0]);
    return new Promise((resolve, reject) => this.#waiting.push({ wanted, resolve, reject }));
  }

  /** As next(), of what comes from now on. */
  nextNew(wanted = () => true) {
    return new Promise((resolve, reject) => this.#waiting.push({ wanted, resolve, reject }));
  }

  send(message) {
    this.sendFrame(TEXT, typeof message === 'string' ? message : JSON.stringify(message));
  }

  ask(what, args = {}) {
    const id = ++this.#lastId;
    this.send({ id, ask: what, ...args });
    return this.next((message) => message.type === 'answer' && message.id === id);
  }

  sendFrame(opcode, payload, options) {
    this.sendBytes(frame(opcode, payload, options));
  }

  sendBytes(bytes) {
    if (this.#socket.writable) this.#socket.write(bytes);
  }

  /** Reads no more: what comes stays in the kernel. */
  stopReading() {
    this.#socket.pause();
  }

  readOn() {
    this.#socket.resume();
  }

  close(code = 1000) {
    const payload = Buffer.alloc(2);
    payload.writeUInt16BE(code);
    this.sendFrame(CLOSE, payload);
  }

  /** Gone without a word, as a page whose computer was switched off. */
  destroy() {
    this.#socket.destroy();
  }
}
