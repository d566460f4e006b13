// node bench_dashboard.mjs [SECONDS]: how often the dashboard draws its traces, and what that costs, with 20
// s of six axes at 120 Hz on the screen. One line of JSON: frames_per_s (all six traces), screen_per_s (what
// the browser offers), script_ms_per_frame, task_share (of one core, by the page's main thread), points,
// heap_mb.
import { join } from 'node:path';
import { openChromium, openPage } from './support/chromium.mjs';
import { reason, webBuild } from './support/environment.mjs';
import { FakeBridge } from './support/fake_bridge.mjs';

const kSeconds = Number(process.argv[2] ?? 5);
const kRate_hz = 120;

/** Counts drawings of the traces (each begins with one clearing of its canvas) and of the screen. */
function count() {
  const { clearRect } = CanvasRenderingContext2D.prototype;
  globalThis.counted = { clears: 0, screens: 0 };
  CanvasRenderingContext2D.prototype.clearRect = function (...all) {
    if (this.canvas.closest('.trace')) ++globalThis.counted.clears;
    return clearRect.apply(this, all);
  };
  const next = () => {
    ++globalThis.counted.screens;
    requestAnimationFrame(next);
  };
  requestAnimationFrame(next);
}

async function measure(page, session) {
  const { metrics } = await session.send('Performance.getMetrics');
  const of = Object.fromEntries(metrics.map(({ name, value }) => [name, value]));
  return {
    ...(await page.evaluate(() => globalThis.counted)),
    at: of.Timestamp,
    script: of.ScriptDuration,
    task: of.TaskDuration,
    heap: of.JSHeapUsedSize,
  };
}

const missing = reason('chromium', 'dashboard');
if (missing) {
  console.error(`the dashboard is not measured: ${missing}`);
  process.exit(77);
}
const bridge = new FakeBridge({ pages: join(webBuild, 'dashboard'), rate_hz: kRate_hz });
await bridge.start();
const browser = await openChromium();
const { page, context } = await openPage(browser, bridge.url, { init: count });
await page.locator('.picture-frame canvas:not(.blank)').waitFor();
bridge.sendAll(
  JSON.stringify({ type: 'samples', samples: bridge.samples(20 * kRate_hz, kRate_hz), lost: 0 }),
);
const session = await context.newCDPSession(page);
await session.send('Performance.enable');
const before = await measure(page, session);
await page.waitForTimeout(kSeconds * 1000);
const after = await measure(page, session);
const seconds = after.at - before.at;
const frames = (after.clears - before.clears) / 6;
const rounded = (value) => Number(value.toPrecision(3));
console.log(
  JSON.stringify({
    frames_per_s: rounded(frames / seconds),
    screen_per_s: rounded((after.screens - before.screens) / seconds),
    script_ms_per_frame: rounded(((after.script - before.script) / frames) * 1e3),
    task_share: rounded((after.task - before.task) / seconds),
    points: 6 * 20 * kRate_hz,
    heap_mb: rounded(after.heap / 1e6),
  }),
);
await browser.close();
await bridge.stop();
