// The dashboard on a real bridge with the simulated sensor: what is shown, and what it does for the one who
// looks.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { openChromium, openPage, shoot } from './support/chromium.mjs';
import { program, reason, scratch, webBuild } from './support/environment.mjs';

const skip = reason('chromium', 'program', 'dashboard');
/** A browser says so when a bridge is not there; that is what is tested. */
const kNoBridge = /WebSocket|ERR_CONNECTION_REFUSED|ERR_CONNECTION_RESET|ERR_EMPTY_RESPONSE/;

let browser;
const children = new Set();
test.before(async () => {
  if (!skip) browser = await openChromium();
});
test.after(async () => {
  for (const child of children) child.kill('SIGKILL');
  await browser?.close();
});

class Bridge {
  constructor() {
    this.folder = scratch('dashboard');
    this.environment = {
      ...process.env,
      XDG_RUNTIME_DIR: this.folder,
      XDG_CONFIG_HOME: join(this.folder, 'config'),
      HOME: this.folder,
    };
    this.sensor = join(this.folder, 'sensor', 'sensor.yaml');
    const options = { env: this.environment };
    const made = spawnSync(program, ['sim', '--out', join(this.folder, 'sensor'), '--frames', '1'], options);
    assert.equal(made.status, 0, String(made.stderr));
  }

  async start(port = 0) {
    const web = [
      '--output',
      `web:127.0.0.1:${port}`,
      '--web-pages',
      webBuild,
      '--recordings',
      join(this.folder, 'recordings'),
    ];
    const args = [
      'run',
      '--source',
      'sim',
      '--sensor',
      this.sensor,
      '--profile',
      'cad',
      '--profile',
      'game',
      ...web,
    ];
    const child = spawn(program, args, { stdio: ['ignore', 'ignore', 'pipe'], env: this.environment });
    this.child = child;
    children.add(child);
    this.ended = new Promise((resolve) => child.on('exit', resolve));
    let said = '';
    this.port = await new Promise((resolve, reject) => {
      child.stderr.on('data', (part) => {
        said += part;
        const found = /pages: http:\/\/127\.0\.0\.1:(\d+)\//.exec(said);
        if (found) resolve(Number(found[1]));
      });
      this.ended.then(() => reject(new Error(said)));
    });
  }

  async stop() {
    this.child.kill('SIGINT');
    await this.ended;
    children.delete(this.child);
  }

  get url() {
    return `http://127.0.0.1:${this.port}/`;
  }
}

const connected = (page) => page.getByText('connected', { exact: true }).waitFor();
const look = () => document.querySelector('.trace canvas').toDataURL();

/** In the page: what the job panel says to do, and how much of each axis is covered (%), as they change. */
function watchJob() {
  window.job = { tasks: [], covered: [] };
  const { tasks, covered } = window.job;
  const look = () => {
    const task = document.querySelector('.job.running .job-task')?.textContent ?? '';
    if (task !== '' && task !== tasks.at(-1)) tasks.push(task);
    const cells = [...document.querySelectorAll('.job.running .coverage-row .gauge-value')];
    const parts = cells.map((cell) => cell.textContent).filter((text) => text.endsWith('%'));
    const axes = parts.map(parseFloat);
    if (axes.length === 6 && axes.join() !== covered.at(-1)?.join()) covered.push(axes);
  };
  new MutationObserver(look).observe(document.body, { subtree: true, childList: true, characterData: true });
}

const isCalibrated = (page) => page.getByText(/Calibrated 20\d\d-/).waitFor();

async function traceMoves(page) {
  const before = await page.evaluate(look);
  await page.waitForFunction((was) => document.querySelector('.trace canvas').toDataURL() !== was, before);
}

test(
  'the real bridge: live, zero, profile, recording, a wizard, and a bridge that comes back',
  { skip },
  async (t) => {
    const bridge = new Bridge();
    await bridge.start();
    const { page, faults, foreign } = await openPage(browser, bridge.url);
    page.setDefaultTimeout(60_000);

    await t.test('traces move, and the picture shows the tags', async () => {
      await connected(page);
      await page.locator('.status.ok').waitFor();
      await traceMoves(page);
      await page.locator('.picture-frame canvas:not(.blank)').waitFor();
      await shoot(page, 'dashboard-real-live');
    });

    await t.test('zero is answered, and done when hands are off', async () => {
      await page.getByRole('button', { name: 'Zero' }).click();
      await page
        .locator('.newest')
        .getByText(/zero|as soon as/)
        .waitFor();
    });

    await t.test('a slider is tried, and reverted', async () => {
      await page.evaluate(() => (location.hash = 'device'));
      const slider = page.getByRole('slider', { name: 'sensitivity, translation' });
      await slider.press('ArrowRight');
      await page.getByText('On trial').waitFor();
      assert.equal(await slider.getAttribute('aria-valuetext'), '1.01');
      await shoot(page, 'dashboard-real-device');
      await page.getByRole('button', { name: 'Revert' }).click();
      await page.waitForFunction(
        () => document.querySelector('#knob-translation').getAttribute('aria-valuetext') === '1',
      );
    });

    await t.test('a recording appears in the list, and can be fetched', async () => {
      await page.evaluate(() => (location.hash = 'record'));
      await page.getByRole('textbox', { name: 'name' }).fill('hand');
      await page.getByRole('button', { name: 'Start' }).click();
      await page.waitForFunction(() =>
        /^[1-9]/.test(document.querySelectorAll('.facts.wide dd')[3]?.textContent ?? ''),
      );
      await shoot(page, 'dashboard-real-record');
      await page.getByRole('button', { name: 'Stop' }).click();
      const link = page.getByRole('link', { name: /Download hand/ });
      const [download] = await Promise.all([page.waitForEvent('download'), link.click()]);
      assert.match(download.suggestedFilename(), /^hand.*\.twr$/);
    });

    await t.test('the target is calibrated, and survives a reload meanwhile', async () => {
      await page.evaluate(() => (location.hash = 'calibrate'));
      await page.getByRole('spinbutton', { name: 'seconds' }).fill('8');
      await page.locator('[data-verb=target]:not([disabled])').click();
      await page.locator('.job.running').waitFor();
      await page.reload();
      await page.locator('.job').waitFor();
      await page.locator('.job:not(.running)').waitFor();
      await shoot(page, 'dashboard-real-target');
      assert.match(
        await page.locator('.job').getAttribute('class'),
        /done/,
        await page.locator('.job').innerText(),
      );
      await page.getByRole('button', { name: 'Close' }).click();
      await page.locator('[data-verb=camera]').waitFor();
      await page.locator('.status.ok').waitFor();
    });

    await t.test('the wrench is calibrated to its end, and what comes then is in its newtons', async () => {
      await page.getByText(/24 steps; about 10 minutes/).waitFor();
      await page.getByText('Not calibrated: newtons come').waitFor();
      await page.evaluate(watchJob);
      await page.locator('[data-verb=wrench]:not([disabled])').click();
      await page.locator('.job.running').waitFor();

      // Meanwhile nothing is measured that could be shown.
      await page.evaluate(() => (location.hash = 'live'));
      await page.locator('.status').getByText('the camera is in use').waitFor();
      await page.waitForFunction(() =>
        [...document.querySelectorAll('.view-live .readings .now')].every((cell) => cell.textContent === '–'),
      );
      await shoot(page, 'dashboard-real-lent');
      await page.evaluate(() => (location.hash = 'calibrate'));

      await page.waitForFunction(() => window.job.covered.at(-1)?.some((part) => part > 0));
      await shoot(page, 'dashboard-real-wrench');
      await page.locator('.job:not(.running)').waitFor({ timeout: 240_000 });
      await shoot(page, 'dashboard-real-wrench-done');
      assert.match(
        await page.locator('.job').getAttribute('class'),
        /done/,
        await page.locator('.job').innerText(),
      );
      const { tasks, covered } = await page.evaluate(() => window.job);
      assert.ok(tasks.length >= 12, `steps that were shown: ${tasks.join(' | ')}`);
      const sums = covered.map((axes) => axes.reduce((sum, part) => sum + part, 0));
      assert.ok(sums.length > 6 && sums[0] < sums.at(-1), `coverage: ${sums}`);
      assert.ok(sums.every((sum, i) => i === 0 || sum >= sums[i - 1] - 1), `coverage falls: ${sums}`);
      assert.ok(covered.at(-1).every((part) => part >= 90), `of six axes, %: ${covered.at(-1)}`);
      const { K } = JSON.parse(readFileSync(join(bridge.folder, 'sensor', 'measured', 'wrench.json'), 'utf8'));
      assert.equal(K.length, 6);

      await page.getByText('Next: make the certificate').waitFor();
      await page.getByRole('button', { name: 'Close' }).click();
      await isCalibrated(page);
      await page.locator('.status.ok').waitFor();
    });

    await t.test('the doctor reports', async () => {
      await page.evaluate(() => (location.hash = 'doctor'));
      await page.getByRole('button', { name: 'Examine' }).click();
      await page.locator('.report-line').first().waitFor();
      await shoot(page, 'dashboard-real-doctor');
      await page.getByRole('button', { name: 'Close' }).click();
    });

    await t.test('nothing went wrong meanwhile', () => {
      assert.deepEqual(faults, []);
      assert.deepEqual(foreign, []);
    });

    await t.test('a bridge that was started again is found again', async () => {
      await page.evaluate(() => (location.hash = 'live'));
      await bridge.stop();
      await page.getByText('No bridge since').waitFor();
      await bridge.start(bridge.port);
      await connected(page);
      await page.locator('.status.ok').waitFor();
      await traceMoves(page);
      await page.evaluate(() => (location.hash = 'calibrate'));
      await isCalibrated(page);
      assert.deepEqual(
        faults.filter((fault) => !kNoBridge.test(fault)),
        [],
      );
    });
    await bridge.stop();
  },
);
