// The page whose screen flips, in real Chromium, before a camera that sees that very screen a known time late.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { kViews, openChromium, openPage, shoot } from './support/chromium.mjs';
import { reason, webBuild } from './support/environment.mjs';
import { serveFolder } from './support/static_server.mjs';

const skip = reason('chromium', 'flip');
const kDelay_ms = 80;
let host;
let browser;

before(async () => {
  if (skip) return;
  host = await serveFolder(`${webBuild}/flip`, { path: '/a/b/flip' });
  browser = await openChromium();
});
after(async () => {
  await browser?.close();
  await host?.close();
});

/** In the page: a camera at 50 Hz whose pictures have the patch's brightness of `delay_ms` ago; `contrast` of 0 looks elsewhere. */
function mirrorCamera({ delay_ms, contrast }) {
  navigator.mediaDevices.getUserMedia = async () => {
    const canvas = document.createElement('canvas');
    canvas.width = 64;
    canvas.height = 48;
    const context = canvas.getContext('2d');
    const paint = (white) => {
      const level = 40 + (white ? contrast : 0);
      context.fillStyle = `rgb(${level},${level},${level})`;
      context.fillRect(0, 0, 64, 48);
    };
    setInterval(() => {
      const white = document.querySelector('.patch').dataset.white === 'true';
      setTimeout(() => paint(white), delay_ms);
    }, 20);
    return canvas.captureStream(50);
  };
}

async function agreeAndGoFast(page) {
  await page.getByLabel('Nobody here is sensitive').check();
  await page.getByLabel('Allow more than 3').check();
  await page.locator('input[type=range]').fill('12');
}

test('nothing flashes before somebody agreed, and never faster than three times a second unless asked', { skip }, async () => {
  const { page, faults, foreign } = await openPage(browser, host.url);
  assert.ok(await page.getByRole('button', { name: 'Measure with this camera' }).isDisabled());
  assert.ok(await page.getByRole('button', { name: 'Only flip' }).isDisabled());
  assert.equal(await page.locator('input[type=range]').getAttribute('max'), '3');
  await page.getByLabel('Nobody here is sensitive').check();
  await page.getByRole('button', { name: 'Only flip' }).click();
  const times = await page.evaluate(() => new Promise((done) => {
    const seen = [];
    new MutationObserver(() => seen.push(performance.now()) === 5 && done(seen))
      .observe(document.querySelector('.patch'), { attributeFilter: ['data-white'] });
  }));
  assert.ok(times[4] - times[0] >= 4 * (500 / 3) - 10, `5 changes within ${times[4] - times[0]} ms`);
  await page.keyboard.press('Escape');
  await page.locator('.patch').waitFor({ state: 'hidden' });
  assert.deepEqual([faults, foreign], [[], []]);
  await page.context().close();
});

test('it measures how late the camera sees the flips', { skip }, async () => {
  const { page, faults } = await openPage(browser, host.url);
  await page.evaluate(mirrorCamera, { delay_ms: kDelay_ms, contrast: 160 });
  await agreeAndGoFast(page);
  await page.getByRole('button', { name: 'Measure with this camera' }).click();
  await page.getByText('round trip').waitFor();
  const [download] = await Promise.all([
    page.waitForEvent('download'), page.getByRole('button', { name: 'Download JSON' }).click(),
  ]);
  const report = JSON.parse(readFileSync(await download.path(), 'utf8'));
  assert.equal(report.format, 'tagwrench-screen-1');
  assert.ok(report.round_trip_s >= kDelay_ms / 1e3, `${report.round_trip_s} s is sooner than the camera sees it`);
  assert.ok(report.round_trip_s < 1.5);
  assert.ok(report.flips.seen >= 50, `${report.flips.seen} flips seen`);
  assert.ok(Math.abs(report.contrast_counts - 160) < 5, `${report.contrast_counts} grey levels`);
  assert.deepEqual(faults, []);
  await shoot(page, 'flip-result', { whole: true });
  await page.context().close();
});

test('a camera that looks elsewhere is told so', { skip }, async () => {
  const { page } = await openPage(browser, host.url);
  await page.evaluate(mirrorCamera, { delay_ms: 0, contrast: 0 });
  await agreeAndGoFast(page);
  await page.getByRole('button', { name: 'Measure with this camera' }).click();
  await page.getByText('the camera does not see the screen flip').waitFor();
  assert.ok(await page.locator('.patch').isHidden());
  await page.context().close();
});

test('without a camera it says so', { skip }, async () => {
  const { page } = await openPage(browser, host.url);
  await page.getByLabel('Nobody here is sensitive').check();
  await page.getByRole('button', { name: 'Measure with this camera' }).click();
  await page.getByText('No camera is there').waitFor();
  await page.context().close();
});

test('views in light and dark, desktop and phone, without scrolling sideways', { skip }, async () => {
  for (const { name, options } of kViews) {
    const { page } = await openPage(browser, host.url, options);
    await shoot(page, `flip-${name}`, { whole: true });
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth));
    await page.context().close();
  }
});
