// The core for web pages beside the program, on the same pictures: time a frame, error after fit, frames a second, size.
//
//   web_core.mjs [--frames N] [--json] [SCENARIO...]     scenarios of tests/sim/scenarios; default realistic and clean
//
// TAGWRENCH_WEB_BUILD and the others as in tests/browser/support/environment.mjs. With --json one object a line for whoever
// makes a table of it: {"case", "where", "median_us", "first_us", "p99_us", "fps", "error_um": [x, y, z], "error_mrad": [x, y, z]}.
// The pictures are gone through several times and the last time counts, for the browser's compiler goes on for a second or so;
// "first_us" is the median of the first time, which a tab's first seconds are like.
import { readFileSync, statSync } from 'node:fs';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { gzipSync } from 'node:zlib';
import { openChromium, openPage } from '../browser/support/chromium.mjs';
import { bundleForPage, coreReason, loadCore, readVectors, run } from '../browser/support/core_node.mjs';
import { errorAfterFit } from '../browser/support/after_fit.mjs';
import { reason, root, scratch, webBuild } from '../browser/support/environment.mjs';
import { serveFolder } from '../browser/support/static_server.mjs';

const kRest = 25;
const kPasses = 6;
const kTargetRatio = 3; // of time, to the program's
const kTargetFps = 60;
const kTargetError = 1.1; // to the program's

const { values, positionals } = parseArgs({ allowPositionals: true, options: { frames: { type: 'string' }, json: { type: 'boolean' } } });
const frames = Number(values.frames ?? 325);
const scenarios = positionals.length ? positionals : ['realistic', 'clean'];

/** Of numbers, sorted here. */
const part = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(sorted.length * share))];

const sortedOf = (numbers) => [...numbers].sort((a, b) => a - b);

function row(name, where, times_us, first_us, readings, truths) {
  const sorted = sortedOf(times_us);
  const error = errorAfterFit(readings, truths);
  return {
    case: name, where, median_us: part(sorted, 0.5), first_us: part(sortedOf(first_us), 0.5), p99_us: part(sorted, 0.99),
    fps: (1e6 * sorted.length) / sorted.reduce((sum, time) => sum + time, 0),
    error_um: error.slice(0, 3).map((e) => e * 1e6), error_mrad: error.slice(3).map((e) => e * 1e3),
  };
}

/** In node: the whole call, the copy of the picture included. */
async function inNode(native) {
  const core = await loadCore({ finder: true });
  const pass = () => {
    core.open(native.sensor, 'sensor.yaml');
    const times = [];
    const readings = [];
    native.frames.forEach((frame, i) => {
      const picture = native.frame(i);
      const begun = performance.now();
      const sample = core.track(picture, native.width, native.height, native.width, BigInt(frame.t_ns), i);
      if (i < kRest) return;
      times.push(1e3 * (performance.now() - begun));
      readings.push([...sample.d_m, ...sample.d_rad]);
    });
    return { times, readings };
  };
  const first = pass().times;
  for (let n = 2; n < kPasses; ++n) pass();
  return { first, ...pass() };
}

/** The same in headless Chromium. */
async function inChromium(folder) {
  await bundleForPage(folder);
  const host = await serveFolder(folder, { headers: { 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp' } });
  const browser = await openChromium();
  try {
    const { page, faults } = await openPage(browser, host.url);
    const result = await page.evaluate(async ({ rest, passes }) => {
      const { Core, loadFinder } = await import('./page.js');
      const begun = performance.now();
      const core = await Core.load();
      const load_ms = performance.now() - begun;
      core.setFinder(await loadFinder());
      const native = await (await fetch('vectors.json')).json();
      const luma = new Uint8Array(await (await fetch('frames.luma')).arrayBuffer());
      const bytes = native.width * native.height;
      const pass = () => {
        core.open(native.sensor, 'sensor.yaml');
        const times = [];
        const readings = [];
        native.frames.forEach((frame, i) => {
          const picture = luma.subarray(i * bytes, (i + 1) * bytes);
          const from = performance.now();
          const sample = core.track(picture, native.width, native.height, native.width, BigInt(frame.t_ns), i);
          if (i < rest) return;
          times.push(1e3 * (performance.now() - from));
          readings.push([...sample.d_m, ...sample.d_rad]);
        });
        return { times, readings };
      };
      const first = pass().times;
      for (let n = 2; n < passes; ++n) pass();
      return { first, ...pass(), load_ms };
    }, { rest: kRest, passes: kPasses });
    if (faults.length > 0) throw new Error(faults[0]);
    return result;
  } finally {
    await browser.close();
    await host.close();
  }
}

async function measure(name) {
  const folder = scratch('bench');
  const ran = run(['sequence', join(root, 'tests/sim/scenarios', `${name}.yaml`), `${frames}`, folder]);
  if (ran.status !== 0) throw new Error(ran.stderr.trim());
  const native = readVectors(folder);
  const moving = native.frames.slice(kRest);
  const truths = moving.map((frame) => frame.truth);
  const rows = [row(name, 'program', moving.map((frame) => frame.track_us), moving.map((frame) => frame.track_us), moving.map((frame) => frame.d), truths)];
  const node = await inNode(native);
  rows.push(row(name, 'node', node.times, node.first, node.readings, truths));
  const lacks = reason('chromium');
  if (lacks) {
    process.stderr.write(`chromium's rows are left out: ${lacks}\n`);
  } else {
    const page = await inChromium(folder);
    rows.push({ ...row(name, 'chromium', page.times, page.first, page.readings, truths), load_ms: page.load_ms });
  }
  native.close();
  return rows;
}

function print(rows) {
  const program = rows[0];
  for (const r of rows) {
    const ratio = r.median_us / program.median_us;
    const error = Math.max(...[...r.error_um, ...r.error_mrad].map((e, i) => e / [...program.error_um, ...program.error_mrad][i]));
    const missed = [];
    if (ratio > kTargetRatio) missed.push(`time > ${kTargetRatio}x`);
    if (error > kTargetError) missed.push(`error > ${kTargetError}x`);
    if (r.fps < kTargetFps) missed.push(`< ${kTargetFps} fps`);
    const numbers = (values, digits) => values.map((v) => v.toFixed(digits)).join(' ');
    console.log(
      `${r.case.padEnd(10)} ${r.where.padEnd(9)} ${r.median_us.toFixed(0).padStart(6)} us  p99 ${r.p99_us.toFixed(0).padStart(6)} us  ` +
      `${ratio.toFixed(2)}x, first ${(r.first_us / program.first_us).toFixed(2)}x  ${r.fps.toFixed(0).padStart(5)} fps  ${numbers(r.error_um, 3)} um  ${numbers(r.error_mrad, 4)} mrad  ` +
      `${error.toFixed(3)}x${missed.length ? `  MISSED: ${missed.join(', ')}` : ''}`);
  }
}

const lacking = coreReason();
if (lacking) {
  console.error(`not measured: ${lacking}`);
  process.exit(1);
}
if (!values.json) {
  const wasm = join(webBuild, 'core/core.wasm');
  const zipped = gzipSync(readFileSync(wasm), { level: 9 }).length;
  console.log(`core.wasm ${(statSync(wasm).size / 1e3).toFixed(0)} kB, gzip ${(zipped / 1e3).toFixed(0)} kB; ${frames - kRest} frames after ${kRest} at rest; the copy of the picture included`);
}
for (const scenario of scenarios) {
  const rows = await measure(scenario);
  if (values.json) rows.forEach((r) => console.log(JSON.stringify(r)));
  else print(rows);
}
