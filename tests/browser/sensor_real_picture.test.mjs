// The tab before the real sensor's one picture, set in motion: as near its truth as the native tracker.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { errorAfterFit, matchPictures } from './support/after_fit.mjs';
import { openChromium, openPage, shoot } from './support/chromium.mjs';
import { writePictures } from './support/clip.mjs';
import { reason, scratch, webBuild } from './support/environment.mjs';
import { displacement, load, reached, record, started } from './support/sensor_page.mjs';
import { serveFolder } from './support/static_server.mjs';

const vectorsProgram = join(webBuild, 'core/core_vectors');
const skip = reason('chromium', 'sensor', 'data') || (!existsSync(vectorsProgram) && 'core_vectors is not built');
const kRate_hz = 25;
const kFrames = 150;
/** The first ones are at rest; they are shown three times over: time to fetch what finds tags. */
const kRestFrames = 25;
const kAxes = ['x', 'y', 'z', 'rx', 'ry', 'rz'];

test('on the real picture in motion its error is at most 1.2 times the native tracker\'s', { skip }, async () => {
  const folder = scratch('real');
  execFileSync(vectorsProgram, ['semi_real', String(kFrames), folder]);
  const { sensor, width, height, frames } = JSON.parse(readFileSync(join(folder, 'vectors.json'), 'utf8'));
  const luma = readFileSync(join(folder, 'frames.luma'));
  const rest = Array.from({ length: kRestFrames }, (_, i) => i);
  const shown = [...rest, ...rest, ...frames.keys()];
  function* pictures() {
    for (const i of shown) yield { width, height, pixels: luma.subarray(i * width * height, (i + 1) * width * height) };
  }
  const clip = writePictures(pictures(), join(folder, 'clip.y4m'), { rate: kRate_hz });
  const file = join(folder, 'sensor.yaml');
  writeFileSync(file, sensor);

  const host = await serveFolder(join(webBuild, 'sensor'));
  const browser = await openChromium({ clip });
  const { page, faults } = await openPage(browser, host.url);
  await load(page, file);
  await page.locator('.sensor-panel p').first().filter({ hasText: 'sensor.yaml:' }).waitFor();
  await started(page);
  await reached(page, 'ok');
  const rows = (await record(page, shown.length)).filter((row) => row.status === 'ok');
  await shoot(page, 'sensor-real-picture');
  await browser.close();
  await host.close();
  assert.deepEqual(faults, []);
  assert.ok(rows.length > 0.7 * shown.length, `${rows.length} of ${shown.length} samples were ok`);

  const { pictures: seen } = matchPictures(
    rows.map((row) => row.t_ns / 1e9), rows.map(displacement), (i) => frames[shown[i]].truth, shown.length, kRate_hz);
  const both = rows.map((row, i) => [displacement(row), frames[shown[seen[i]]]])
    .filter(([, frame]) => frame.status === 'ok'); // natively it is learning in the pictures at rest
  const ours = errorAfterFit(both.map(([d]) => d), both.map(([, frame]) => frame.truth));
  const theirs = errorAfterFit(both.map(([, frame]) => frame.d), both.map(([, frame]) => frame.truth));
  console.log(`# after fit here ${ours.map((v) => v.toExponential(2))}; natively ${theirs.map((v) => v.toExponential(2))}; ${both.length} pictures`);
  ours.forEach((error, axis) => {
    assert.ok(error < 1.2 * theirs[axis], `${kAxes[axis]}: ${error} here, ${theirs[axis]} natively (m or rad, after a fit)`);
  });
});
