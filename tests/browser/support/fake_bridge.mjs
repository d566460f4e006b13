// A bridge that is none: speaks the pages' protocol, and does what no honest bridge does (another version,
// garbage, silence).
//
//   const bridge = new FakeBridge({ pages: folder, token: '', port: 0, rate_hz: 60 });
//   await bridge.start();   bridge.url      await bridge.stop();  (start() again uses the same port)
//   bridge.hello, bridge.state    what is told; bridge.tellState() tells it now
//   bridge.asked                  every ask, in order; bridge.replies[what] = (ask) => ({ok, text, data})
//   bridge.sendAll(textOrBytes)   anything
//   bridge.wrench = (t_s) => [Fx Fy Fz Mx My Mz]
import { readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join } from 'node:path';
import { grayPng } from './gray_png.mjs';
import { fakeHello, fakeState } from './fake_bridge_words.mjs';
import { ServedSocket } from './websocket_server.mjs';

export const kPolicy =
  "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; frame-src 'self'; base-uri 'none'; form-action 'none'";
const kTypes = {
  '.html': 'text/html',
  '.js': 'text/javascript',
  '.css': 'text/css',
  '.svg': 'image/svg+xml',
};
const kCertificate = '<!doctype html><title>Certificate</title><h1>Certificate</h1><p>Fx 0.43 % of range</p>';

/**
 * As the profile of fakeState() says, for a hand that comes back from beyond its dead zone; HID y and z
 * are the camera's, reversed.
 */
function motionOf(value, axis) {
  const push = axis % 3 === 0 ? value : -value;
  const [full, dead] = [
    [0.6, 0.6, 2, 0.012, 0.012, 0.008][axis],
    [0.014, 0.014, 0.056, 4.2e-4, 4.2e-4, 2.1e-4][axis],
  ];
  return Math.sign(push) * Math.max(0, Math.min(1, (Math.abs(push) - dead) / (full - dead))) ** 1.6;
}

export class FakeBridge {
  constructor({ pages, token = '', port = 0, rate_hz = 60, certificate = kCertificate }) {
    Object.assign(this, {
      pages,
      certificate,
      token,
      port,
      rate_hz,
      sockets: new Set(),
      asked: [],
      replies: {},
      wantPictures: new Set(),
    });
    this.hello = fakeHello();
    this.state = fakeState();
    this.zero = [0, 0, 0, 0, 0, 0];
    this.sequence = 0;
    this.wrench = (t) => [
      0.3 * Math.sin(2 * t),
      0.2 * Math.cos(1.3 * t),
      0.8 * Math.sin(0.7 * t),
      6e-3 * Math.sin(1.7 * t),
      4e-3 * Math.cos(t),
      3e-3 * Math.sin(2.3 * t),
    ];
    this.silent = false;
  }

  get url() {
    return `http://127.0.0.1:${this.port}/`;
  }

  async start() {
    this.server = createServer((request, response) => this.#serve(request, response));
    this.server.on('upgrade', (request, socket) => this.#upgrade(request, socket));
    await new Promise((done, failed) =>
      this.server.once('error', failed).listen(this.port, '127.0.0.1', done),
    );
    this.port = this.server.address().port;
    this.began = process.hrtime.bigint();
    this.due = 0;
    this.timers = [
      setInterval(() => this.#tellSamples(), 33),
      setInterval(() => this.tellState(), 500),
      setInterval(() => this.#tellPicture(), 100),
    ];
  }

  async stop() {
    this.timers.forEach(clearInterval);
    for (const socket of this.sockets) socket.cut();
    this.server.closeAllConnections();
    await new Promise((done) => this.server.close(done));
  }

  sendAll(data) {
    for (const socket of this.sockets) socket.send(data);
  }

  tellState() {
    if (!this.silent) this.sendAll(JSON.stringify({ type: 'state', ...this.state }));
  }

  tellHello() {
    this.sendAll(JSON.stringify({ type: 'hello', ...this.hello }));
  }

  tellJob(job) {
    this.state.job = job;
    this.sendAll(JSON.stringify({ type: 'job', job }));
  }

  /** `count` samples that end now, as fast as they can be made. */
  samples(count, rate_hz = this.rate_hz) {
    const until = Number(process.hrtime.bigint() - this.began) / 1e9;
    return Array.from({ length: count }, (_, i) => this.#sample(until - (count - 1 - i) / rate_hz));
  }

  #sample(t_s) {
    const w = this.wrench(t_s).map(
      (value, i) => value - this.zero[i] + (i < 3 ? 2e-3 : 2e-5) * (Math.random() - 0.5),
    );
    return {
      seq: this.sequence++,
      t_ns: Math.round(t_s * 1e9) + 1e9,
      status: this.state.status,
      d_m: [w[0] / 2100, w[1] / 2100, w[2] / 2800],
      d_rad: [w[3] / 0.4, w[4] / 0.4, w[5] / 0.4],
      d_sigma: [2e-7, 2e-7, 1e-6, 1e-5, 1e-5, 5e-6],
      f_n: w.slice(0, 3),
      m_nm: w.slice(3),
      w_sigma: [4e-3, 4e-3, 2e-2, 1.2e-4, 1.2e-4, 8e-5],
      dropped: 0,
      latency_us: 812,
      zero: this.zero,
      zero_state: this.state.zero_state,
      motion: w.map(motionOf),
      buttons: 0,
      residual_px: 0.02,
      tags_held: 2,
    };
  }

  #tellSamples() {
    const elapsed = Number(process.hrtime.bigint() - this.began) / 1e9;
    const count = Math.min(64, Math.floor(elapsed * this.rate_hz) - this.due);
    this.due = Math.floor(elapsed * this.rate_hz);
    this.state.frames += count;
    if (count > 0 && !this.silent)
      this.sendAll(JSON.stringify({ type: 'samples', samples: this.samples(count), lost: 0 }));
  }

  #tellPicture() {
    if (this.wantPictures.size === 0) return;
    const tags = [
      { id: 5, px: [120, 130, 300, 140, 290, 330, 110, 310] },
      { id: 2, px: [350, 140, 530, 130, 540, 310, 360, 330] },
    ];
    this.picture ??= grayPng(640, 480, tags);
    const header = Buffer.from(
      JSON.stringify({ seq: this.sequence, t_ns: 0, width: 640, height: 480, tags, status: 'ok' }),
    );
    const length = Buffer.alloc(4);
    length.writeUInt32LE(header.length);
    const message = Buffer.concat([length, header, this.picture]);
    for (const socket of this.wantPictures) socket.send(message);
  }

  #serve(request, response) {
    const path = new URL(request.url, 'http://localhost').pathname;
    if (path.startsWith('/files/')) return this.#serveFile(path, request, response);
    const file = join(this.pages, path === '/' ? 'index.html' : path);
    if (path.includes('..') || !statSync(file, { throwIfNoEntry: false })?.isFile())
      return response.writeHead(404).end('not found');
    response.writeHead(200, {
      'Content-Type': kTypes[extname(file)] ?? 'text/plain',
      'Content-Security-Policy': kPolicy,
      'Cache-Control': 'no-store',
    });
    response.end(readFileSync(file));
  }

  #serveFile(path, request, response) {
    if (this.token && request.headers.authorization !== `Bearer ${this.token}`)
      return response.writeHead(401).end('token');
    if (path.endsWith('.html'))
      return response.writeHead(200, { 'Content-Type': 'text/html' }).end(this.certificate);
    response.writeHead(200, { 'Content-Type': 'application/octet-stream' }).end(`contents of ${path}`);
  }

  #upgrade(request, socket) {
    const offered = (request.headers['sec-websocket-protocol'] ?? '').split(',').map((name) => name.trim());
    const word = `tagwrench.token.${Buffer.from(this.token).toString('base64url')}`;
    if (this.token && !offered.includes(word))
      return socket.end('HTTP/1.1 401 Unauthorized\r\nConnection: close\r\n\r\n');
    const served = new ServedSocket(
      request,
      socket,
      offered.includes('tagwrench.v1') ? 'tagwrench.v1' : undefined,
    );
    this.sockets.add(served);
    served.onclose = () => {
      this.sockets.delete(served);
      this.wantPictures.delete(served);
    };
    served.onmessage = (text) => this.#asked(served, JSON.parse(text));
    served.send(JSON.stringify({ type: 'hello', ...this.hello }));
    served.send(JSON.stringify({ type: 'state', ...this.state }));
  }

  #asked(socket, ask) {
    this.asked.push(ask);
    const reply = this.replies[ask.ask]?.(ask) ?? this.#usual(socket, ask);
    if (reply)
      socket.send(JSON.stringify({ type: 'answer', id: ask.id, ok: true, text: '', data: null, ...reply }));
  }

  #usual(socket, ask) {
    switch (ask.ask) {
      case 'pictures':
        this.wantPictures[ask.on ? 'add' : 'delete'](socket);
        return {};
      case 'zero':
        this.zero = this.wrench(Number(process.hrtime.bigint() - this.began) / 1e9);
        this.wrench = (
          (w) => () =>
            w
        )(this.zero);
        return { text: 'zero is set' };
      case 'recordings':
        return {
          text: '/home/u/.local/share/tagwrench/recordings',
          data: [
            { name: 'push.twr', bytes: 12345678, date: '2026-11-02T14:05:00Z' },
            { name: 'weights.twr', bytes: 987654321, date: '2026-11-01T09:30:00Z' },
          ],
        };
      case 'plans':
        return {
          data: [
            {
              name: 'six_orientations',
              needs: 'one kitchen weight of 50 g and a string; the sensor lies six ways',
              minutes: 10,
              steps: 24,
            },
            { name: 'load_cell', needs: 'a load cell on the board', minutes: 5, steps: 18 },
          ],
        };
      case 'show':
        return { text: this.state.profile.text, data: { file: '', written: this.state.profile.text } };
      case 'try':
        Object.assign(this.state.profile, { text: ask.text, trial: true });
        this.tellState();
        return { text: `${ask.name} is tried` };
      case 'revert':
      case 'keep':
        this.state.profile.trial = false;
        this.tellState();
        return { text: this.state.profile.name };
      case 'record_start':
        this.state.recording = {
          file: `${ask.name}.twr`,
          seconds: 12.3,
          bytes: 1234567,
          frames: 300,
          dropped: 0,
          disk_left_s: 86000,
        };
        this.tellState();
        return { text: `${ask.name}.twr` };
      case 'record_stop':
        this.state.recording = null;
        this.tellState();
        return { text: '/home/u/.local/share/tagwrench/recordings/push.twr: 300 frames, 1.23 MB' };
      default:
        return { text: 'done' };
    }
  }
}
