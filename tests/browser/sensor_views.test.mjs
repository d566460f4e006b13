// How the tab looks: pictures in light and dark, desktop and phone; nothing beyond the edge, nothing without a name, keys enough.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { kViews, openChromium, openPage, shoot } from './support/chromium.mjs';
import { simulate, writeClip } from './support/clip.mjs';
import { reason, scratch, webBuild } from './support/environment.mjs';
import { reached, started } from './support/sensor_page.mjs';
import { serveFolder } from './support/static_server.mjs';

const skip = reason('chromium', 'program', 'sensor');
const kScenario = 'seed: 1\ntrajectory: {motion: compound, rest_s: 2.4}\n';
let host;
let browser;

before(async () => {
  if (skip) return;
  const folder = simulate({ scenario: kScenario, frames: 120 });
  host = await serveFolder(join(webBuild, 'sensor'));
  browser = await openChromium({ clip: writeClip(folder, join(scratch('clip'), 'clip.y4m')) });
});
after(async () => {
  await browser?.close();
  await host?.close();
});

/** Measuring, and pushed: traces to be seen. */
async function measuring(page) {
  await started(page);
  await reached(page, 'ok');
  await pushed(page);
}

async function pushed(page) {
  await page.waitForFunction(() => {
    const force = Number(document.querySelectorAll('.readings tbody tr')[1].querySelector('.now').textContent.replace('\u2212', '-'));
    return Math.abs(force) > 0.2;
  }, null, { polling: 50 });
}

const kWatchShifts = () => {
  globalThis.shifts = [];
  new PerformanceObserver((list) => {
    for (const entry of list.getEntries())
      if (!entry.hadRecentInput) globalThis.shifts.push([entry.value, ...entry.sources.map(({ node }) => node?.outerHTML?.slice(0, 80))]);
  }).observe({ type: 'layout-shift', buffered: true });
};

/** Nothing is cut off, and what is touched is large enough. */
async function assertUsableAt360px(page) {
  await page.setViewportSize({ width: 360, height: 740 });
  const small = await page.evaluate(() => {
    const shown = [...document.querySelectorAll('button, select, input:not([type=checkbox]):not([type=range])')]
      .filter((element) => element.checkVisibility() && !element.classList.contains('unseen'));
    return shown.filter((element) => element.getBoundingClientRect().height < 44).map((element) => element.outerHTML);
  });
  assert.deepEqual(small, []);
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'wider than 360 px');
}

/** Every control has a name, and those that matter are reached with Tab. */
async function assertUsableByKeys(page) {
  const nameless = await page.evaluate(() => [...document.querySelectorAll('button, select, input, summary, [tabindex]')]
    .filter((element) => element.checkVisibility() && element.getAttribute('aria-hidden') !== 'true')
    .filter((element) => !(element.textContent.trim() || element.labels?.length || element.getAttribute('aria-label')))
    .map((element) => element.outerHTML));
  assert.deepEqual(nameless, []);
  const wanted = new Set(['Stop', 'Zero', 'Record', 'Load files', 'Save sensor.yaml']);
  for (let i = 0; i < 60 && wanted.size > 0; i++) {
    await page.keyboard.press('Tab');
    wanted.delete(await page.evaluate(() => document.activeElement.textContent.trim()));
  }
  assert.deepEqual([...wanted], []);
}

for (const { name, options } of kViews) {
  test(`the view ${name}`, { skip }, async () => {
    const { page, faults, foreign } = await openPage(browser, host.url, { ...options, init: kWatchShifts });
    await measuring(page);
    // As browsers score it: the header that came later had 0.04.
    assert.deepEqual((await page.evaluate(() => globalThis.shifts)).filter(([value]) => value > 1e-3), [], 'something moved by itself');
    await shoot(page, `sensor-${name}`);
    // What is out of sight is not drawn: all of it is brought into sight.
    const height = await page.evaluate(() => document.documentElement.scrollHeight);
    await page.setViewportSize({ width: options.viewport.width, height });
    await page.locator('.platform canvas').waitFor();
    await pushed(page);
    await shoot(page, `sensor-${name}-whole`);
    assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), 'wider than the screen');
    if (name === 'light-phone') await assertUsableAt360px(page);
    if (name === 'light-desktop') await assertUsableByKeys(page);
    assert.deepEqual([faults, foreign], [[], []]);
    await page.context().close();
  });
}
