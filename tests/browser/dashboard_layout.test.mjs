// Nothing in the dashboard moves by itself: not when words, numbers, jobs, recordings and the bridge come and go. And a phone's
// first screen has what matters.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import test from 'node:test';
import { openChromium, openPage, shoot } from './support/chromium.mjs';
import { reason, webBuild } from './support/environment.mjs';
import { FakeBridge } from './support/fake_bridge.mjs';
import { kJobs } from './support/fake_jobs.mjs';

const skip = reason('chromium', 'dashboard');
const kSizes = {
  desktop: { viewport: { width: 1280, height: 800 }, colorScheme: 'light' },
  phone: {
    viewport: { width: 390, height: 844 }, deviceScaleFactor: 2, isMobile: true, hasTouch: true, colorScheme: 'dark',
  },
};
const kNoBridge = /WebSocket|ERR_CONNECTION_REFUSED|ERR_CONNECTION_RESET|ERR_EMPTY_RESPONSE/;
/** As browsers score it, of one change; the banner that pushed the page down by 45 px had 0.03. */
const kStill = 1e-4;

const kLongWords = '/home/u/tagwrench/sensor.yaml:12: tags: family aruco_originl is none of aruco_original, aruco_4x4_50';
const kRecording = { file: 'push.twr', seconds: 9, bytes: 9e5, frames: 99, dropped: 0, disk_left_s: 86_000 };
const kWritten = { kind: 'note', text: 'written: /home/u/.config/tagwrench/measured/target.yaml and /home/u/.config/tagwrench/measured/rest.png' };

/** Each one after the other: [what is told, how]. */
const kTold = [
  ['all there is', ({ state }) => {
    Object.assign(state, { status: 'lost', words: 'the picture is black: is the lens cap on, is there light?' });
    Object.assign(state, { zero_state: 'far', recording: { ...kRecording }, clients: [] });
    state.profile.trial = true;
    state.camera_controls[1].writable = false;
  }],
  ['wide numbers', ({ state }) =>
    Object.assign(state.recording, { seconds: 3700, bytes: 1.2e9, frames: 123_456, dropped: 12_345, disk_left_s: 55 })],
  ['little', ({ state }) => {
    Object.assign(state, { status: 'ok', words: 'held', zero_state: 'following', recording: null });
    state.clients = [{ name: 'freecad', by: 'spnav' }, { name: 'spacenavd', by: 'hidraw' }];
    state.profile.trial = false;
    state.camera_controls[1].writable = true;
  }],
  ['no sensor', (bridge) => {
    bridge.sendAll(JSON.stringify({ type: 'say', line: 'words that go on and on '.repeat(20) }));
    Object.assign(bridge.state, { running: false, status: '', words: kLongWords });
  }],
  ['a sensor', ({ state }) => Object.assign(state, { running: true, status: 'ok', words: 'held' })],
];

const drawn = (page) => page.evaluate(async () => {
  for (let i = 0; i < 3; ++i) await new Promise(requestAnimationFrame);
});
const shifts = async (page) => {
  await drawn(page);
  return page.evaluate(() => globalThis.shifts.splice(0));
};

/** Tells it, and waits until the page has heard. */
async function tell(bridge, page, what) {
  what(bridge);
  bridge.state.latency_us.median = Math.round(1000 + Math.random() * 98_000);
  bridge.tellState();
  const latency = (bridge.state.latency_us.median / 1e3).toFixed(2);
  await page.waitForFunction((wanted) => globalThis.heard === wanted, latency);
}

async function still(page, where) {
  const moved = (await shifts(page)).filter(([value]) => value > kStill);
  assert.deepEqual(moved, [], where);
}

const kWatch = () => {
  globalThis.shifts = [];
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries())
      globalThis.shifts.push([entry.value, ...entry.sources.map(({ node }) => node?.outerHTML?.slice(0, 80) ?? node?.nodeName)]);
  }).observe({ type: 'layout-shift' });
  // What the page has heard of last.
  const Plain = globalThis.WebSocket;
  globalThis.WebSocket = class extends Plain {
    constructor(...given) {
      super(...given);
      this.addEventListener('message', ({ data }) => {
        if (typeof data !== 'string' || !data.includes('"type":"state"')) return;
        const { median } = JSON.parse(data).latency_us;
        queueMicrotask(() => (globalThis.heard = (median / 1e3).toFixed(2)));
      });
    }
  };
};

async function watchJob(bridge, page, verb) {
  const whole = kJobs[verb];
  const running = { verb, state: 'running', lines: [], live: '', coverage: null, progress: null, keys: ['stop'], result: null };
  const { lines, coverage } = whole;
  await tell(bridge, page, () => bridge.tellJob(running));
  await shifts(page); // where it comes, it pushes what is below: somebody has begun it
  const steps = [
    { live: 'short' },
    { lines, progress: 0.1, live: 'steady for 0.6 of 1 s; reads Fz 0.49 N; and what else is to be told while it goes on, at length' },
    { lines, progress: 0.2, coverage },
    { lines: [...lines, kWritten], state: 'done', progress: 1, coverage, keys: [], result: whole.result },
  ];
  for (const [step, change] of steps.entries()) {
    await tell(bridge, page, () => bridge.tellJob({ ...running, ...change }));
    await still(page, `${verb}, step ${step}`);
  }
  await tell(bridge, page, () => bridge.tellJob(null));
  await shifts(page);
}

for (const [size, options] of Object.entries(kSizes)) {
  test(`nothing moves by itself, ${size}`, { skip }, async () => {
    const bridge = new FakeBridge({ pages: join(webBuild, 'dashboard') });
    await bridge.start();
    const browser = await openChromium();
    try {
      const { page, faults } = await openPage(browser, bridge.url, { ...options, init: kWatch });
      await page.getByText('connected', { exact: true }).waitFor();
      for (const view of ['live', 'device', 'record', 'camera', 'calibrate', 'certificate', 'doctor']) {
        await page.evaluate((name) => (location.hash = name), view);
        await page.locator(`.view-${view}`).waitFor();
        if (view === 'record') await page.locator('.list tbody tr').first().waitFor();
        await tell(bridge, page, () => {});
        await shifts(page);
        for (const [words, what] of kTold) {
          await tell(bridge, page, what);
          await still(page, `${view}: ${words}`);
        }
        const jobs = { calibrate: ['camera', 'target', 'wrench'], certificate: ['certificate'], doctor: ['doctor'] }[view] ?? [];
        for (const verb of jobs) await watchJob(bridge, page, verb);
      }
      await page.evaluate(() => (location.hash = 'live'));
      await page.locator('.view-live').waitFor();
      await shifts(page);
      await bridge.stop();
      await page.getByText('No bridge since').waitFor();
      await still(page, 'the bridge goes');
      await shoot(page, `dashboard-no-bridge-${size}`);
      await bridge.start();
      await page.getByText('connected', { exact: true }).waitFor();
      await page.locator('.banner').waitFor({ state: 'hidden' });
      await still(page, 'the bridge comes back');
      assert.deepEqual(faults.filter((fault) => !kNoBridge.test(fault)), []);
    } finally {
      await browser.close();
      await bridge.stop();
    }
  });
}

test('a phone: six numbers and the first traces on one screen, and the whole width of the certificate', { skip }, async () => {
  const certificate = '<!doctype html><style>body{width:186mm;margin:8mm auto}i{display:block;background:#14406b;height:9px}</style><i></i>';
  const bridge = new FakeBridge({ pages: join(webBuild, 'dashboard'), certificate });
  await bridge.start();
  const browser = await openChromium();
  try {
    const { page } = await openPage(browser, bridge.url, kSizes.phone);
    await page.getByText('connected', { exact: true }).waitFor();
    const bottoms = await page.evaluate(() => ({
      numbers: [...document.querySelectorAll('.readings .now')].map((cell) => cell.getBoundingClientRect().bottom),
      traces: [...document.querySelectorAll('.trace')].map((trace) => trace.getBoundingClientRect().bottom),
      screen: document.querySelector('footer').getBoundingClientRect().top,
    }));
    const seen = (all) => all.filter((bottom) => bottom <= bottoms.screen).length;
    assert.equal(seen(bottoms.numbers), 6);
    assert.ok(seen(bottoms.traces) >= 2, `${seen(bottoms.traces)} traces`);
    bridge.tellJob(kJobs.certificate);
    await page.evaluate(() => (location.hash = 'certificate'));
    const paper = page.frameLocator('iframe.certificate').locator('i');
    await paper.waitFor();
    await page.waitForFunction(
      (screen) => {
        const frame = document.querySelector('iframe.certificate');
        const { left, right } = frame.getBoundingClientRect();
        return left >= 0 && right <= screen && frame.clientWidth > 740; // 186 mm are 703 px
      },
      kSizes.phone.viewport.width,
    );
    await shoot(page, 'dashboard-certificate-paper-phone');
  } finally {
    await browser.close();
    await bridge.stop();
  }
});
