// Every view of the dashboard, light and dark, on a desktop and on a phone: a picture of each for people to
// look at. Nothing stands out of the page, and nothing is in the console.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import test from 'node:test';
import { kViews, openChromium, openPage, shoot } from './support/chromium.mjs';
import { reason, webBuild } from './support/environment.mjs';
import { FakeBridge } from './support/fake_bridge.mjs';
import { kJobs } from './support/fake_jobs.mjs';

const skip = reason('chromium', 'dashboard');

/** What to show, where, and what is seen once it is there. */
const kScenes = [
  { name: 'live', at: 'live', seen: '.picture-frame canvas:not(.blank)' },
  { name: 'live-lost', at: 'live', status: 'lost', seen: '.status.lost' },
  { name: 'device', at: 'device', seen: '.knob' },
  { name: 'record', at: 'record', seen: '.list tbody tr' },
  { name: 'camera', at: 'camera', seen: '.picture-frame canvas:not(.blank)' },
  { name: 'calibrate', at: 'calibrate', seen: '.plan-needs:not(:empty)' },
  { name: 'calibrate-camera', at: 'calibrate', job: kJobs.camera, seen: '.coverage-map .none' },
  { name: 'calibrate-target', at: 'calibrate', job: kJobs.target, seen: '.job.done' },
  { name: 'calibrate-wrench', at: 'calibrate', job: kJobs.wrench, seen: '.coverage-row' },
  { name: 'calibrate-check', at: 'calibrate', job: kJobs.check, seen: '.report-line.error' },
  { name: 'certificate', at: 'certificate', job: kJobs.certificate, seen: 'iframe.certificate' },
  { name: 'doctor', at: 'doctor', job: kJobs.doctor, seen: '.report-line.error' },
];

for (const view of kViews) {
  test(`every view, ${view.name}`, { skip }, async () => {
    const bridge = new FakeBridge({ pages: join(webBuild, 'dashboard'), rate_hz: 60 });
    await bridge.start();
    const browser = await openChromium();
    try {
      const { page, faults, foreign } = await openPage(browser, bridge.url, view.options);
      await page.getByText('connected', { exact: true }).waitFor();
      // Traces that are full, as after a while.
      bridge.sendAll(JSON.stringify({ type: 'samples', samples: bridge.samples(1200), lost: 0 }));
      for (const { name, at, seen, job = null, status = 'ok' } of kScenes) {
        bridge.state.status = status;
        bridge.state.words =
          status === 'lost' ? 'the picture is black: is the lens cap on, is there light?' : 'held';
        bridge.tellState();
        bridge.tellJob(job);
        await page.evaluate((hash) => (location.hash = hash), at);
        await page.locator(seen).first().waitFor();
        const wide = await page.evaluate(() => [
          document.documentElement.scrollWidth,
          document.documentElement.clientWidth,
        ]);
        assert.ok(wide[0] <= wide[1], `${name} is ${wide[0]} px wide, the window ${wide[1]}`);
        await shoot(page, `dashboard-${name}-${view.name}`);
      }
      assert.deepEqual(faults, []);
      assert.deepEqual(foreign, []);
    } finally {
      await browser.close();
      await bridge.stop();
    }
  });
}
