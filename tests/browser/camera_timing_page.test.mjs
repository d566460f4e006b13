// The screen of `tagwrench camera-timing --screen web`: its page in real Chromium, orders and clocks of the program, and a camera
// (tests/unit/web/screen_program.cpp) that sees what the page shows a known time late.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { existsSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { createInterface } from 'node:readline';
import { openChromium, openPage, shoot } from './support/chromium.mjs';
import { program, reason, webBuild } from './support/environment.mjs';
import { WsPage } from './support/ws.mjs';

const screen = process.env.TAGWRENCH_SCREEN ?? join(dirname(program), '../tests/unit/web/screen_program');
const skip = reason('chromium', 'flip') || (!existsSync(screen) && `the test program is not built (${screen})`);
let browser;

before(async () => {
  if (!skip) browser = await openChromium();
});
after(() => browser?.close());

class Measurement {
  static async start(seconds) {
    const self = new Measurement();
    self.child = spawn(screen, [webBuild, String(seconds)]);
    self.child.stdin.on('error', () => {}); // it may have ended
    const lines = createInterface({ input: self.child.stdout });
    self.url = await new Promise((resolve) => lines.once('line', resolve));
    self.out = '';
    self.err = '';
    lines.on('line', (line) => (self.out += line));
    self.child.stderr.on('data', (text) => (self.err += text));
    self.ended = new Promise((resolve) => self.child.on('close', resolve));
    self.port = Number(new URL(self.url).port);
    return self;
  }
  /** What the camera sees from now on. */
  show(level) {
    this.child.stdin.write(`${level}\n`);
  }
}

/** The page shows the program's flips to the camera, `delay_ms` late. */
async function opened(measurement, delay_ms) {
  const { page, faults } = await openPage(browser, measurement.url);
  await page.exposeFunction('seen', (white) => {
    setTimeout(() => measurement.show(white ? 200 : 40), delay_ms);
  });
  await page.evaluate(() => new MutationObserver(() => window.seen(document.querySelector('.patch').dataset.white === 'true'))
    .observe(document.querySelector('.patch'), { attributeFilter: ['data-white'] }));
  return { page, faults };
}

async function become(page) {
  await page.getByLabel('Nobody here is sensitive').check();
  await page.getByRole('button', { name: 'Be the screen' }).click();
}

async function measured(delay_ms) {
  const measurement = await Measurement.start(4);
  const { page, faults } = await opened(measurement, delay_ms);
  assert.ok(await page.getByRole('button', { name: 'Be the screen' }).isDisabled(), 'nothing flashes before somebody agreed');
  const changes = page.evaluate(() => new Promise((done) => {
    const times = [];
    new MutationObserver(() => times.push(performance.now()) === 12 && done(times))
      .observe(document.querySelector('.patch'), { attributeFilter: ['data-white'] });
  }));
  await become(page);
  const times = await changes;
  assert.ok(times[11] - times[1] >= 10 * (500 / 3) - 20, 'no more than three flashes a second');
  assert.equal(await measurement.ended, 0, measurement.err);
  await page.getByText('tagwrench camera-timing has ended').waitFor();
  await page.locator('.patch').waitFor({ state: 'hidden' });
  assert.deepEqual(faults, []);
  await page.context().close();
  return JSON.parse(measurement.out);
}

test('the page flips for the program, which finds how much later one camera sees it than another', { skip }, async () => {
  const soon = await measured(0);
  const late = await measured(150);
  for (const report of [soon, late]) {
    assert.equal(report.format, 'tagwrench-screen-1');
    assert.match(report.screen, /^a page of http:\/\/127\.0\.0\.1:\d+\/, its clock known to [\d.]+ ms$/);
    assert.ok(report.flips.seen >= 10, `${report.flips.seen} flips seen`);
    assert.equal(report.contrast_counts, 160);
  }
  // What the two have in common is Chromium's and this machine's; a timer is never early.
  const more = late.latency_s.value - soon.latency_s.value;
  const sigma = Math.hypot(late.latency_s.sigma, soon.latency_s.sigma);
  assert.ok(late.latency_s.value > 0.15 - 3 * late.latency_s.sigma - 0.01, `${late.latency_s.value} s is sooner than it can be seen`);
  assert.ok(Math.abs(more - 0.15) < 0.05 + 3 * sigma, `150 ms later, found ${more} +- ${sigma} s`);
});

test('any key ends it, here and there, in words', { skip }, async () => {
  const measurement = await Measurement.start(6);
  const { page } = await opened(measurement, 0);
  await become(page);
  await page.getByText('flip 1;').waitFor();
  await shoot(page, 'flip-for-program');
  await page.keyboard.press('Escape');
  assert.equal(await measurement.ended, 1);
  assert.match(measurement.err, /somebody ended it at the page/);
  await page.locator('.patch').waitFor({ state: 'hidden' });
  await page.context().close();
});

test('a closed page ends the measurement, in words', { skip }, async () => {
  const measurement = await Measurement.start(6);
  const { page } = await opened(measurement, 0);
  await become(page);
  await page.getByText('flip 1;').waitFor();
  await page.context().close();
  assert.equal(await measurement.ended, 1);
  assert.match(measurement.err, /the page is gone|somebody ended it/);
});

test('where no program waits any more, the page says so', { skip }, async () => {
  const measurement = await Measurement.start(6);
  const { page } = await opened(measurement, 0);
  measurement.child.kill();
  await measurement.ended;
  await become(page);
  await page.getByText('tagwrench camera-timing does not answer').waitFor();
  await page.locator('.patch').waitFor({ state: 'hidden' });
  await page.context().close();
});

/** Answers as a screen would whose clock began hours ago. */
class HandMade {
  static async open(measurement) {
    const self = new HandMade();
    self.link = await WsPage.connect(measurement.port);
    return self;
  }
  now_ms = () => 3.6e7 + performance.now();
  async ready() {
    assert.ok((await this.link.ask('screen')).ok);
    for (let i = 0; i < 16; i++) {
      const { number } = await this.link.next((m) => m.type === 'time');
      assert.ok((await this.link.ask('time', { number, page_ms: this.now_ms() })).ok);
    }
    return this.link.next((m) => m.type === 'flip');
  }
}

test('what a page makes up is refused in words, and the measurement lives', { skip }, async () => {
  const measurement = await Measurement.start(6);
  const one = await HandMade.open(measurement);
  const order = await one.ready();
  const two = await HandMade.open(measurement);
  const refusals = [
    [two, 'screen', {}, /another page is the screen/],
    [two, 'flipped', { number: order.number, page_ms: 1 }, /not the screen/],
    [one, 'time', { number: 1, page_ms: one.now_ms() }, /nobody asked/],
    [one, 'flipped', { number: order.number + 7, page_ms: one.now_ms() }, /no such flip/],
    [one, 'flipped', { number: 'x', page_ms: one.now_ms() }, /no such flip/],
    [one, 'flipped', { number: order.number }, /milliseconds/],
    [one, 'flipped', { number: order.number, page_ms: -1 }, /milliseconds/],
    [one, 'flipped', { number: order.number, page_ms: 1e300 }, /milliseconds/],
    [one, 'zero', {}, /nothing that a screen can ask/],
  ];
  for (const [page, what, rest, words] of refusals) {
    const answer = await page.link.ask(what, rest);
    assert.ok(!answer.ok, what);
    assert.match(answer.text, words);
  }
  assert.ok((await one.link.ask('flipped', { number: order.number, page_ms: one.now_ms() })).ok, 'hours between the clocks are no matter');
  const next = await one.link.next((m) => m.type === 'flip');
  const jump = await one.link.ask('flipped', { number: next.number, page_ms: one.now_ms() + 60_000 });
  assert.match(jump.text, /clock jumps/);
  assert.equal(await measurement.ended, 1);
  assert.match(measurement.err, /clock jumps/);
});
