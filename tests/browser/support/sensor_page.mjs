// The tab, as a person would use it.
//
//   await started(page)                    the camera runs (pressing Start unless it was allowed before and runs by itself)
//   await reached(page, 'ok')              its status is this one
//   await load(page, ...paths)             files are chosen; the tracker takes or refuses them after that
//   const files = await savedSensor(page, ...names)   what `Save sensor.yaml` gives, by name, once these are among it
//   const rows = await record(page, rows)  as many samples, by way of the CSV that people download
import { readFileSync } from 'node:fs';
import { parseTable } from './clip.mjs';

export const startButton = (page) => page.locator('.status-line > button').first();

export async function started(page) {
  const words = page.locator('.status');
  await words.filter({ hasNotText: /not started|loading/ }).waitFor();
  if ((await words.textContent()) === 'press Start') await startButton(page).click();
}

export const reached = (page, status) => page.locator(`.status[data-status='${status}']`).waitFor();

export async function load(page, ...paths) {
  await page.locator('.sensor-panel input[type=file]').setInputFiles(paths);
}

export async function savedSensor(page, ...names) {
  const files = {};
  const seen = [];
  const take = (download) => seen.push(download);
  page.on('download', take);
  await page.getByRole('button', { name: 'Save sensor.yaml' }).click();
  const there = () => names.every((name) => seen.some((download) => download.suggestedFilename() === name));
  for (let i = 0; i < 100 && !there(); i++) await page.waitForTimeout(100);
  page.off('download', take);
  for (const download of seen) files[download.suggestedFilename()] = readFileSync(await download.path(), 'utf8');
  return files;
}

export async function record(page, rows) {
  await page.getByRole('button', { name: 'Record', exact: true }).click();
  await page.waitForFunction(
    (wanted) => Number(/^(\d+) samples/.exec(document.querySelector('.record-panel .row > .number').textContent)?.[1]) >= wanted,
    rows,
  );
  await page.getByRole('button', { name: 'Stop recording' }).click();
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'Download CSV' }).click()]);
  return parseTable(readFileSync(await download.path(), 'utf8'));
}

const kDisplacement = ['dx_m', 'dy_m', 'dz_m', 'rx_rad', 'ry_rad', 'rz_rad'];
const kWrench = ['fx_n', 'fy_n', 'fz_n', 'mx_nm', 'my_nm', 'mz_nm'];
export const displacement = (row) => kDisplacement.map((name) => row[name]);
export const wrench = (row) => kWrench.map((name) => row[name]);
