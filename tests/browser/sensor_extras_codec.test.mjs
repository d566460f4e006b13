// What the tab says to the board and hears from it and from the bridge's HID device: the very bytes of protocol/README.md, and
// host/tools/reading/examples/wrench_report.js as the second opinion on a report.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { before, test } from 'node:test';
import { reason, root } from './support/environment.mjs';
import { loadModule } from './support/typescript.mjs';

const skip = reason('packages', 'sensor');
let frames;
let messages;
let hid;

before(async () => {
  if (skip) return;
  frames = await loadModule('sensor/extras/board_frame.ts');
  messages = await loadModule('sensor/extras/board_messages.ts');
  hid = await loadModule('sensor/extras/wrench_hid.ts');
});

/** The frames of the chapters on messages: name -> bytes. */
function goldenFrames() {
  const golden = new Map();
  const text = readFileSync(join(root, 'protocol/README.md'), 'utf8');
  for (const chapter of text.split(/^### /m).slice(1)) {
    const name = chapter.slice(0, chapter.indexOf('\n')).trim();
    const lines = chapter.split('\n').map((line) => /^ {4}((?:[0-9A-F]{2} )*[0-9A-F]{2})(?: {2}|$)/.exec(line)?.[1]);
    const bytes = lines.filter(Boolean).join(' ').split(' ').map((byte) => parseInt(byte, 16));
    golden.set(name, Uint8Array.from(bytes));
  }
  return golden;
}

test('the golden frames are read whole, and written again they are the same bytes', { skip }, () => {
  const golden = goldenFrames();
  assert.ok(golden.size >= 16, `${golden.size} frames in the README`);
  for (const [name, bytes] of golden) {
    const reader = new frames.FrameReader();
    const read = reader.take(bytes);
    assert.equal(read.length, 1, name);
    assert.deepEqual(frames.writeFrame(read[0]), bytes, name);
    assert.equal(reader.damaged, 0);
  }
});

test('what the board says is understood as the README tells', { skip }, () => {
  const golden = goldenFrames();
  const news = (name) => {
    const [{ kind, message }] = new frames.FrameReader().take(golden.get(name));
    return messages.readNews(kind, message);
  };
  const hello = news('Hello');
  assert.deepEqual([hello.major, hello.board, hello.firmware, hello.bootId, hello.session], [1, 'atmega328p', '0.1.0', 0xb007b007, 0x5ea51234]);
  assert.deepEqual(news('CellSample'), { kind: 'cell', channel: 2, counts: -123456, time_us: 16909060, saturated: false });
  assert.deepEqual(news('Capabilities'), { kind: 'capabilities', cells: 4, ledLevels: 256, ledSustained_permille: 300 });
  assert.deepEqual(news('TareResult'), { kind: 'tare', channel: 3, mean_counts: 84213, spread_counts: 190 });
  assert.deepEqual(news('Answer'), { kind: 'answer', request: 126, result: 1 });
  assert.deepEqual(news('Status'), { kind: 'status', session: 0x5ea51234, led_permille: 300, limited: true, supply_mv: 4985 });
});

test('requests are the bytes of the README', { skip }, () => {
  const golden = goldenFrames();
  const { Kind } = messages;
  const frame = (kind, sequence, message) => frames.writeFrame({ kind, sequence, message });
  assert.deepEqual(frame(Kind.helloRequest, 0, messages.helloRequest(0x5ea51234)), golden.get('HelloRequest'));
  assert.deepEqual(frame(Kind.timeRequest, 3, new Uint8Array(0)), golden.get('TimeRequest'));
  assert.deepEqual(frame(Kind.tare, 4, messages.tare(11, 80)), golden.get('Tare'));
});

test('damaged, cut and endless frames are dropped, and the next is read', { skip }, () => {
  for (const bytes of goldenFrames().values()) {
    for (let at = 0; at < bytes.length - 1; at++) {
      for (const bit of [1, 16, 128]) {
        const reader = new frames.FrameReader();
        const hurt = Uint8Array.from(bytes);
        hurt[at] ^= bit;
        const read = [...reader.take(hurt), ...reader.take(bytes)];
        assert.deepEqual(frames.writeFrame(read.at(-1)), bytes);
        assert.ok(read.length === 1 && reader.damaged >= 1, `byte ${at}, bit ${bit}`);
      }
    }
    const reader = new frames.FrameReader();
    assert.equal(reader.take(new Uint8Array(5000).fill(7)).length, 0);
    assert.equal(reader.take(Uint8Array.from([0, ...bytes])).length, 1);
  }
});

test('a message that is none is null, one with more fields is not', { skip }, () => {
  const read = (...bytes) => messages.readNews(messages.Kind.cellSample, Uint8Array.from(bytes));
  const cell = { kind: 'cell', channel: 2, counts: -1, time_us: 0, saturated: false };
  const endless = new Array(10).fill(0xff);
  const noMessages = [
    [0x1d, 1, 2, 3], [0x08], [0x08, ...endless], [...endless], [0x7a, 2, 0], [0x7a, 0xff, 0xff, 0xff, 0xff, 0x0f], // cut, endless
    [0x00], [0x00, 1], [0x7c], [0x0c], [0x7e, 1], [0x7f], // field 0, a group's end, types that are none
  ];
  assert.deepEqual(read(0x08, 2, 0x10, 1), cell);
  for (const bytes of noMessages) assert.equal(read(0x08, 2, 0x10, 1, ...bytes), null, `${bytes}`);
  assert.deepEqual(read(0x08, 9, 0x7a, 1, 0, 0x78, 3, 0x10, 1, 0x08, 2), cell);
  assert.equal(messages.readNews(messages.Kind.hello, Uint8Array.from([0x1a, 4, 0x41, 0x0a, 0xff, 0x42])).board, 'A??B');
});

test('no message makes the reader read beyond it or fail', { skip }, () => {
  let state = 1;
  const random = () => (state = (state * 1664525 + 1013904223) >>> 0) / 2 ** 32;
  for (let i = 0; i < 20000; i++) {
    const message = Uint8Array.from({ length: Math.floor(random() * 81) }, () => Math.floor(random() * 256));
    messages.readNews(0x81 + Math.floor(random() * 12), message);
  }
});

test('a report is read as the published example reads it', { skip }, () => {
  const example = createRequire(import.meta.url)(join(root, 'host/tools/reading/examples/wrench_report.js'));
  let state = 7;
  const random = () => (state = (state * 1664525 + 1013904223) >>> 0);
  let read = 0;
  for (let i = 0; i < 3000; i++) {
    const data = new DataView(new ArrayBuffer(i % 50 === 0 ? 62 : 63));
    for (let at = 0; at + 4 <= data.byteLength; at += 4) data.setUint32(at, random() >> (at < 24 ? 0 : 1) & 0x7fffffff, true);
    data.setUint32(52, random() % (i % 40 === 0 ? 2e6 : 1e6), true);
    for (let at = 0; at < 24; at += 4) data.setInt32(at, random() | 0, true);
    if (data.byteLength > 62) data.setUint8(62, i % 7);
    const theirs = example.decodeWrench(0x20, data);
    const ours = hid.decodeReport(0x20, data);
    assert.equal(ours === null, theirs === null);
    if (!ours) continue;
    read++;
    const close = (a, b) => a.forEach((value, k) => assert.ok(Math.abs(value - b[k]) < 1e-9, `${value} for ${b[k]}`));
    close(ours.f_n, theirs.force_n);
    close(ours.m_nm, theirs.torque_nm);
    close(ours.w_sigma, [...theirs.forceSigma_n, ...theirs.torqueSigma_nm]);
    assert.deepEqual([ours.seq, ours.status, ours.dropped], [theirs.sequence, theirs.status, theirs.lost]);
    assert.ok(Math.abs(ours.t_ns / 1e9 - theirs.captureTime_s) < 1e-6);
  }
  assert.ok(read > 1000, `${read} reports were read`);
  assert.equal(hid.decodeReport(0x21, new DataView(new ArrayBuffer(63))), null);
});
