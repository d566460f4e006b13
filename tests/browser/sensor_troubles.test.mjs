// What the tab says where it cannot measure, and what it makes of odd cameras.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { openChromium, openPage, shoot } from './support/chromium.mjs';
import { readTable, simulate, writeClip } from './support/clip.mjs';
import { reason, scratch, webBuild } from './support/environment.mjs';
import { load, reached, savedSensor, startButton, started } from './support/sensor_page.mjs';
import { serveFolder } from './support/static_server.mjs';

const skip = reason('chromium', 'sensor');
let host;
let bare; // a browser without a camera
let wired; // one with Chromium's own moving picture

before(async () => {
  if (skip) return;
  host = await serveFolder(join(webBuild, 'sensor'));
  bare = await openChromium({ ask: true, hosts: { 'sensor.test': '127.0.0.1' } });
  wired = await openChromium({ camera: true });
});
after(async () => {
  await bare?.close();
  await wired?.close();
  await host?.close();
});

/** The page with something taken away; `words` must be there to read, and nothing be broken. */
async function says(browser, url, init, ...words) {
  const { page, faults, foreign } = await openPage(browser, url, { init });
  for (const text of words) await page.getByText(text).first().waitFor();
  assert.deepEqual([faults.filter((fault) => !fault.includes('manifest')), foreign], [[], []]);
  return page;
}

test('an address that browsers give no camera to', { skip }, async () => {
  const page = await says(bare, `http://sensor.test:${host.port}/`, undefined, 'gives no camera to this address', `http://localhost:${host.port}/`);
  await shoot(page, 'sensor-insecure');
  await page.context().close();
});

test('a browser without cameras, without WebAssembly SIMD, without modules in workers', { skip }, async () => {
  const cases = [
    [() => delete Navigator.prototype.mediaDevices, 'no access to cameras'],
    [() => (WebAssembly.validate = () => false), 'WebAssembly has no SIMD'],
    [() => delete window.WebAssembly, 'does not run WebAssembly'],
    [() => (window.Worker = class { terminate() {} }), 'runs no modules in workers'],
  ];
  for (const [init, words] of cases) {
    const page = await says(bare, host.url, init, words, /version 123|current Chromium/);
    assert.equal(await startButton(page).count(), 0);
    await page.context().close();
  }
});

test('no camera: it is told, and opened by itself when one is plugged in', { skip }, async () => {
  const page = await says(bare, host.url, undefined, 'press Start');
  await startButton(page).click();
  await page.getByText('No camera is there').waitFor();
  await page.evaluate(() => {
    const canvas = document.createElement('canvas');
    canvas.width = 640;
    canvas.height = 480;
    canvas.getContext('2d').fillRect(0, 0, 640, 480);
    navigator.mediaDevices.enumerateDevices = async () => [{ kind: 'videoinput', deviceId: 'new', label: 'new camera' }];
    navigator.mediaDevices.getUserMedia = async () => canvas.captureStream(10);
    navigator.mediaDevices.dispatchEvent(new Event('devicechange'));
  });
  await page.getByRole('button', { name: 'Stop', exact: true }).waitFor();
  await page.context().close();
});

test('a camera that is refused, in use, or without such a mode', { skip }, async () => {
  const cases = [
    ['NotAllowedError', 'The camera was refused', 'address bar'],
    ['NotReadableError', 'in use, or does not answer', 'Close other programs'],
    ['OverconstrainedError', 'no such mode', 'Choose another size'],
  ];
  for (const [name, ...words] of cases) {
    const page = await says(bare, host.url, undefined, 'press Start');
    await page.evaluate((error) => {
      navigator.mediaDevices.getUserMedia = () => Promise.reject(new DOMException('no', error));
    }, name);
    await startButton(page).click();
    for (const text of words) await page.getByText(text).first().waitFor();
    await page.context().close();
  }
});

test('a tracker that cannot be fetched', { skip }, async () => {
  const { page, context } = await openPage(bare, 'about:blank');
  await page.route(/\.wasm$/, (route) => route.abort());
  await page.goto(host.url);
  await page.getByText('the tracker cannot be loaded').waitFor();
  await context.close();
});

test('a picture without tags says what is wrong; another size than the sensor\'s is told', { skip }, async () => {
  const page = await says(wired, host.url, undefined);
  await started(page);
  await page.locator('.hint-words').filter({ hasText: /no tag is seen|image is/ }).waitFor();
  await page.getByLabel('Size', { exact: true }).selectOption('320x240');
  await page.getByText('delivers 320×240, but the sensor is described for 640×480').waitFor();
  await page.context().close();
});

test('exposure and focus have sliders where the browser can set them', { skip }, async () => {
  const page = await says(wired, host.url, undefined);
  await started(page);
  await page.getByText('Automatics are off').waitFor(); // as this camera is from the start
  await page.getByLabel('Exposure', { exact: true }).fill('60');
  await page.getByText('60 × 0.1 ms').waitFor();
  await page.context().close();
});

test('one button holds all automatics at what they have found, and lets them go again', { skip }, async () => {
  const page = await says(wired, host.url, () => {
    const now = { exposureMode: 'continuous', focusMode: 'continuous', exposureTime: 35 };
    const settings = MediaStreamTrack.prototype.getSettings;
    MediaStreamTrack.prototype.getSettings = function () { return { ...settings.call(this), ...now }; };
    MediaStreamTrack.prototype.applyConstraints = async ({ advanced: [request] }) => void Object.assign(now, (window.asked = request));
  });
  await started(page);
  const hold = page.getByRole('button', { name: /[Ee]xposure and focus/ });
  await page.getByText('Automatics are on').waitFor();
  await hold.click();
  await page.getByText('Automatics are off').waitFor();
  assert.equal(await hold.getAttribute('aria-pressed'), 'true');
  const asked = await page.evaluate(() => window.asked);
  assert.deepEqual([asked.exposureMode, asked.exposureTime, asked.focusMode], ['manual', 35, 'manual']);
  await hold.click();
  await page.getByText('Automatics are on').waitFor();
  await page.context().close();
});

test('a second tab leaves the camera to the first, and takes over when told to', { skip }, async () => {
  const { page: first, context } = await openPage(wired, host.url);
  await started(first);
  await first.getByRole('button', { name: 'Stop', exact: true }).waitFor();
  const second = await context.newPage();
  await second.goto(host.url);
  await started(second);
  await second.getByText('another tab of this browser measures already').waitFor();
  await second.getByRole('button', { name: 'Measure in this tab' }).click();
  await first.getByText('another tab has taken over').waitFor();
  await second.getByRole('button', { name: 'Stop', exact: true }).waitFor();
  await context.close();
});

test('a mirrored camera is noticed, and one button sets it right; then the zero button takes off what reads at rest', { skip: skip || reason('program') }, async () => {
  const folder = simulate({ scenario: 'seed: 4\ncamera: {mirrored: true}\ntrajectory: {motion: rest}\n', frames: 40 });
  const browser = await openChromium({ clip: writeClip(folder, join(scratch('clip'), 'mirrored.y4m')) });
  const { page, faults } = await openPage(browser, host.url);
  await started(page);
  await page.getByRole('button', { name: 'My camera is mirrored' }).click();
  await reached(page, 'ok');
  assert.ok(await page.getByRole('button', { name: 'My camera is mirrored' }).isHidden());

  // As if the camera had sunk by 0.04 mm since: four springs of 0.7 N/mm read 0.112 N at rest.
  const saved = await savedSensor(page, 'sensor.yaml', 'target.yaml');
  const sunk = saved['target.yaml']
    .replace(/(rest:[^]*?position_mm: \[[^,]*,[^,]*,)([^\]]*)/, (_, before, z) => `${before} ${Number(z) + 0.04}`);
  const to = scratch('sunk');
  writeFileSync(join(to, 'sunk.yaml'), saved['sensor.yaml']);
  writeFileSync(join(to, 'target.yaml'), sunk);
  await load(page, join(to, 'sunk.yaml'), join(to, 'target.yaml'));
  await page.locator('.sensor-panel p').first().filter({ hasText: 'sunk.yaml' }).waitFor();
  const reads = (newtons) => page.waitForFunction((wanted) => {
    const cell = document.querySelectorAll('.readings tbody tr')[2].querySelector('.now');
    return Math.abs(Number(cell.textContent.replace('\u2212', '-')) - wanted) < 0.01;
  }, newtons);
  await reads(-0.112);
  await page.keyboard.press('0');
  await page.getByText('zero: what read is nothing now').waitFor();
  await reads(0);
  assert.deepEqual(faults, []);
  await browser.close();
});

test('whoever moves the platform at the start is told to let it rest; a zero while it is pushed waits, and is refused', { skip: skip || reason('program') }, async () => {
  const folder = simulate({ scenario: 'seed: 3\ntrajectory: {motion: compound, rest_s: 0.24}\n', frames: 30 });
  const pictures = readTable(join(folder, 'frames.csv')).map(({ file }) => readFileSync(join(folder, file), 'base64'));
  const page = await says(bare, host.url, undefined, 'press Start');
  await load(page, join(folder, 'sensor.yaml'));
  await page.locator('.sensor-panel p').first().filter({ hasText: 'sensor.yaml: tags 5, 2' }).waitFor();
  const there = pictures.slice(6);
  await page.evaluate(cameraOf, { still: pictures.slice(0, 6), moving: [...there, ...[...there].reverse()] });
  await startButton(page).click();
  const status = page.locator('.status');
  const hint = page.locator('.hint-words');
  await hint.filter({ hasText: 'the platform moved while its rest pose was learned; let it rest' }).waitFor();
  await status.filter({ hasText: 'hold still: learning the rest pose' }).waitFor();
  await shoot(page, 'sensor-hold-still');
  await page.evaluate(() => window.show('still'));
  await reached(page, 'ok');
  await hint.filter({ hasText: 'rest pose learned' }).waitFor();

  const most = (test) => page.waitForFunction((code) => {
    const read = [...document.querySelectorAll('.readings .now')].slice(0, 3);
    const newtons = Math.max(...read.map((cell) => Math.abs(Number(cell.textContent.replace('\u2212', '-')))));
    return code === 'rest' ? newtons < 0.02 : newtons > 0.1;
  }, test);
  await most('rest');
  await page.evaluate(() => window.show('moving'));
  await most('pushed');
  await page.getByRole('button', { name: 'Zero' }).click();
  await hint.filter({ hasText: 'zero: waits until the platform rests; hands off' }).waitFor();
  await hint.filter({ hasText: 'zero: refused, the platform did not come to rest; let go of it' }).waitFor();
  await shoot(page, 'sensor-zero-refused');
  await page.evaluate(() => window.show('still'));
  await most('rest'); // what read at rest before is nothing still
  await page.context().close();
});

/** In the page: the camera gives the pictures (PNG in base64) of one of two lists, in turn, 25 a second. */
async function cameraOf({ still, moving }) {
  const decoded = (list) => Promise.all(list.map((text) =>
    createImageBitmap(new Blob([Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0))]))));
  const lists = { still: await decoded(still), moving: await decoded(moving) };
  const canvas = Object.assign(document.createElement('canvas'), { width: 640, height: 480 });
  const context = canvas.getContext('2d');
  let shown = lists.moving;
  let next = 0;
  window.show = (name) => (shown = lists[name]);
  setInterval(() => context.drawImage(shown[next++ % shown.length], 0, 0), 40);
  navigator.mediaDevices.getUserMedia = async () => canvas.captureStream(25);
}

test('the bridge\'s device is read in newtons, and a board lit', { skip }, async () => {
  const page = await says(bare, host.url, mockDevices, 'press Start');
  await page.getByText('The bridge\'s device, and the board').click();
  await page.getByRole('button', { name: 'Read the bridge\'s newtons' }).click();
  await page.getByText('Test wrench: ok').waitFor();
  assert.match(await page.locator('.hid-values').textContent(), /Fx.?1\.250 N.*Mz.?\u22122\.50 mN m/);
  await page.getByRole('button', { name: 'Connect the board' }).click();
  await page.getByText('atmega328p, firmware 0.1.0').waitFor();
  await page.waitForFunction(() => window.sent.some((frame) => frame[1] === 3)); // kind 3: light
  assert.deepEqual(await page.evaluate(() => window.opened), { baudRate: 500000 });
  await page.context().close();
});

/** In the page: a wrench sensor on HID that reports 1.25 N and -2.5 mN m, and a board that says hello to whoever says it. */
function mockDevices() {
  const device = new EventTarget();
  Object.assign(device, { vendorId: 0x1209, productId: 0x7a6e, productName: 'Test wrench', opened: false });
  device.open = async () => {
    setInterval(() => {
      const data = new DataView(new ArrayBuffer(63));
      data.setInt32(0, 1250000, true);
      data.setInt32(20, -2500, true);
      device.oninputreport?.({ reportId: 0x20, data, device });
    }, 20);
  };
  const hid = new EventTarget();
  hid.requestDevice = async () => [device];
  Object.defineProperty(Navigator.prototype, 'hid', { get: () => hid });

  window.sent = [];
  const crc16 = (bytes) => bytes.reduce((crc, byte) => {
    let value = crc ^ (byte << 8);
    for (let i = 0; i < 8; i++) value = (value & 0x8000 ? (value << 1) ^ 0x1021 : value << 1) & 0xffff;
    return value;
  }, 0xffff);
  const stuff = (bytes) => {
    const out = [0];
    let code = 0;
    for (const byte of bytes) {
      if (byte === 0) { out[code] = out.length - code; code = out.length; }
      out.push(byte);
    }
    out[code] = out.length - code;
    return Uint8Array.from([...out, 0]);
  };
  const unstuff = (bytes) => {
    const out = [];
    for (let at = 0; bytes[at]; ) {
      const code = bytes[at];
      out.push(...bytes.slice(at + 1, at + code));
      at += code;
      if (bytes[at]) out.push(0);
    }
    return out;
  };
  const text = (field, words) => [field << 3 | 2, words.length, ...new TextEncoder().encode(words)];
  const port = {
    open: async (options) => {
      window.opened = options;
      let answer;
      port.readable = new ReadableStream({ start: (controller) => (answer = controller) });
      port.writable = new WritableStream({
        write: (bytes) => {
          const frame = unstuff([...bytes]);
          window.sent.push(bytes);
          if (frame[0] !== 1) return;
          const session = frame.slice(frame.indexOf(0x1d) + 1, -2); // field 3 of HelloRequest
          const body = [0x81, 0, 0x08, 1, ...text(3, 'atmega328p'), ...text(4, '0.1.0'), 0x45, ...session];
          const crc = crc16(body);
          answer.enqueue(stuff([...body, crc & 0xff, crc >> 8]));
        },
      });
    },
    close: async () => undefined,
  };
  const serial = new EventTarget();
  serial.requestPort = async () => port;
  Object.defineProperty(Navigator.prototype, 'serial', { get: () => serial });
}
