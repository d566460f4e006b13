// The dashboard in real headless Chromium, on a bridge that can be told to misbehave.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import test from 'node:test';
import { openChromium, openPage } from './support/chromium.mjs';
import { reason, webBuild } from './support/environment.mjs';
import { FakeBridge } from './support/fake_bridge.mjs';

const skip = reason('chromium', 'dashboard');
const kPages = join(webBuild, 'dashboard');
const kViews = ['live', 'device', 'record', 'camera', 'calibrate', 'certificate', 'doctor'];

let browser;
test.before(async () => {
  if (!skip) browser = await openChromium();
});
test.after(() => browser?.close());

/** Runs `body` with a bridge and a page on it, and looks afterwards that nothing went wrong in the page. */
function onBridge(name, body, { token = '', at = '', expected = () => false, options = {} } = {}) {
  test(name, { skip }, async () => {
    const bridge = new FakeBridge({ pages: kPages, token });
    await bridge.start();
    const opened = await openPage(browser, bridge.url + at, options);
    try {
      await body({ bridge, ...opened });
      assert.deepEqual(
        opened.faults.filter((fault) => !expected(fault)),
        [],
      );
      assert.deepEqual(opened.foreign, []);
    } finally {
      await opened.context.close();
      await bridge.stop();
    }
  });
}

const connected = (page) => page.getByText('connected', { exact: true }).waitFor();
const asked = async (bridge, page, what) => {
  for (;;) {
    const found = bridge.asked.find((ask) => ask.ask === what);
    if (found) return found;
    await page.evaluate(() => new Promise(requestAnimationFrame));
  }
};
const traceOf = (page) =>
  page
    .locator('.trace canvas')
    .first()
    .evaluate((canvas) => canvas.toDataURL());

/** Until the first trace looks otherwise than `before`. */
async function traceMoves(page) {
  const before = await traceOf(page);
  await page.waitForFunction((was) => document.querySelector('.trace canvas').toDataURL() !== was, before);
}

onBridge('traces move, numbers and picture come, nothing shifts', async ({ page }) => {
  await connected(page);
  await page.evaluate(() => {
    globalThis.shifts = 0;
    new PerformanceObserver((list) =>
      list.getEntries().forEach((entry) => (globalThis.shifts += entry.value)),
    ).observe({ type: 'layout-shift' });
  });
  await traceMoves(page);
  await page.waitForFunction(
    () => !document.querySelector('.picture-frame canvas').classList.contains('blank'),
  );
  await page.waitForFunction(() => /\d\.\d{3}/.test(document.querySelector('.readings .now').textContent));
  await traceMoves(page);
  assert.ok((await page.evaluate(() => globalThis.shifts)) < 0.01, 'layout shift, as browsers score it');
});

onBridge(
  'zero is asked for by button and by key, its answer told, and the numbers follow',
  async ({ bridge, page }) => {
    await connected(page);
    await page.getByRole('button', { name: 'Zero' }).click();
    await page.locator('.newest').getByText('zero is set').waitFor();
    await page.waitForFunction(() =>
      [...document.querySelectorAll('.readings .now')].every(
        (cell) => Math.abs(Number(cell.textContent.replace('\u2212', '-'))) < 0.05,
      ),
    );
    await page.locator('main').press('0');
    while (bridge.asked.filter((ask) => ask.ask === 'zero').length < 2)
      await page.evaluate(() => new Promise(requestAnimationFrame));
  },
);

onBridge('pause holds the traces, and going on lets them move', async ({ page }) => {
  await connected(page);
  await traceMoves(page);
  await page.keyboard.press('p');
  await page.locator('.traces.paused').waitFor();
  const held = await page.evaluate(async () => {
    const look = () => document.querySelector('.trace canvas').toDataURL();
    await new Promise(requestAnimationFrame);
    const before = look();
    for (let i = 0; i < 10; ++i) await new Promise(requestAnimationFrame);
    return before === look();
  });
  assert.ok(held);
  await page.keyboard.press('p');
  await traceMoves(page);
});

onBridge(
  'a bridge that comes back is found again; what is shown meanwhile is called old',
  async ({ bridge, page }) => {
    await connected(page);
    await asked(bridge, page, 'pictures');
    await bridge.stop();
    await page.getByText('No bridge since').waitFor();
    bridge.asked.length = 0;
    await bridge.start();
    await connected(page);
    assert.equal(await page.locator('.banner').isHidden(), true);
    await asked(bridge, page, 'pictures');
    await traceMoves(page);
  },
  {
    expected: (fault) =>
      /WebSocket|ERR_CONNECTION_REFUSED|ERR_CONNECTION_RESET|ERR_EMPTY_RESPONSE/.test(fault),
  },
);

onBridge(
  'a page that is older than the bridge says so, and does not go on asking',
  async ({ bridge, page }) => {
    bridge.hello.protocol = 2;
    bridge.tellHello();
    await page.getByText('This page is older than the bridge').waitFor();
    await page.getByRole('button', { name: 'Reload' }).waitFor();
    while (bridge.sockets.size > 0) await page.evaluate(() => new Promise(requestAnimationFrame));
  },
);

onBridge('garbage, and what a newer bridge may say, changes nothing', async ({ bridge, page }) => {
  await connected(page);
  const garbage = [
    '',
    'null',
    '[]',
    '7',
    '{"type":',
    '{"type":"samples"}',
    '{"type":"samples","samples":[1,null,{},{"seq":1}],"lost":"x"}',
    '{"type":"newer","x":1}',
    '{"type":"state"}',
    '{"type":"job","job":{"verb":"x","lines":7}}',
    '{"type":"job","job":null}',
    '{"type":"answer","id":999999}',
    '{"type":"say"}',
    Buffer.alloc(0),
    Buffer.alloc(3),
    Buffer.from([255, 255, 255, 255, 0]),
  ];
  for (const one of garbage) bridge.sendAll(one);
  await traceMoves(page);
  await page.locator('.status.ok').waitFor();
});

onBridge('text from the bridge is shown as text', async ({ bridge, page }) => {
  await connected(page);
  bridge.sendAll(JSON.stringify({ type: 'say', line: '<img src=x onerror=alert(1)> careful' }));
  await page.locator('.newest').getByText('<img src=x onerror=alert(1)> careful').waitFor();
});

onBridge('a flood of samples is drawn no oftener than the screen', async ({ bridge, page }) => {
  await connected(page);
  const message = JSON.stringify({ type: 'samples', samples: bridge.samples(64, 1000), lost: 3 });
  for (let i = 0; i < 300; ++i) bridge.sendAll(message);
  await page.getByText('this page missed 900 samples').waitFor();
  await traceMoves(page);
});

onBridge(
  'without the token the page says where the address is',
  async ({ page }) => {
    await page.getByText('does not let this page in').waitFor();
  },
  { token: 'correct horse battery', expected: (fault) => fault.includes('WebSocket') },
);

onBridge(
  'the token leaves the address at once, is kept for the tab, and opens the bridge',
  async ({ page }) => {
    await connected(page);
    assert.equal(new URL(page.url()).hash, '');
    await page.reload();
    await connected(page);
    await page.goto(`${page.url()}#record`);
    await page.getByRole('button', { name: 'Download push.twr' }).waitFor();
    const [download] = await Promise.all([
      page.waitForEvent('download'),
      page.getByRole('button', { name: 'Download push.twr' }).click(),
    ]);
    assert.equal(download.suggestedFilename(), 'push.twr');
  },
  { token: 'correct horse battery', at: '#token=correct%20horse%20battery' },
);

onBridge('a slider is tried as it moves, reverted and kept', async ({ bridge, page }) => {
  await page.goto(`${page.url()}#device`);
  const slider = page.getByRole('slider', { name: 'sensitivity, translation' });
  await slider.focus();
  await slider.press('ArrowRight');
  const { name, text } = await asked(bridge, page, 'try');
  assert.equal(name, 'cad');
  assert.match(text, /\ntranslation: 1\.01\n/);
  assert.match(text, /\nrotation: 1\n/);
  await page.getByText('On trial').waitFor();
  await page.getByRole('button', { name: 'Keep' }).click();
  await asked(bridge, page, 'keep');
  await page.getByRole('combobox', { name: 'in force' }).selectOption('game');
  assert.equal((await asked(bridge, page, 'profile')).name, 'game');
});

onBridge('a profile is saved as the text of its file, and a ready-made one under a name of its own', async ({ bridge, page }) => {
  const { text } = bridge.state.profile;
  const written = `# mine\n${text}`;
  bridge.replies.show = () => ({ text, data: { file: '', written } });
  await page.goto(`${page.url()}#device`);
  await page.getByRole('slider', { name: 'sensitivity, translation' }).press('ArrowRight');
  await asked(bridge, page, 'try');
  await page.getByRole('button', { name: 'Save to a file' }).click();
  const saved = await asked(bridge, page, 'save_profile');
  assert.deepEqual([saved.name, saved.as], ['cad', 'cad-mine']);
  assert.equal(
    saved.file_text,
    written.replace('name: "cad"', 'name: "cad-mine"').replace('\ntranslation: 1\n', '\ntranslation: 1.01\n'),
  );
  assert.match(saved.text, /^name: "cad-mine"\n/);
});

onBridge('what is reverted to is said by name', async ({ bridge, page }) => {
  await page.goto(`${page.url()}#device`);
  await page.getByRole('slider', { name: 'sensitivity, translation' }).press('ArrowRight');
  await page.getByRole('button', { name: 'Revert' }).click();
  await page.locator('.newest').getByText('Profile cad is in force, as it was before the trial').waitFor();
  assert.equal(bridge.state.profile.trial, false);
});

onBridge('a refused trial is told, and the sliders go back', async ({ bridge, page }) => {
  bridge.replies.try = () => ({ ok: false, text: 'cad:9: translation: out of range' });
  await page.goto(`${page.url()}#device`);
  const slider = page.getByRole('slider', { name: 'sensitivity, translation' });
  await slider.press('End');
  await page.locator('.newest.error').getByText('out of range').waitFor();
  await page.waitForFunction(
    () => document.querySelector('#knob-translation').getAttribute('aria-valuetext') === '1',
  );
});

onBridge('a text that is refused stays in its box, whatever is told meanwhile', async ({ bridge, page }) => {
  bridge.replies.try = () => ({ ok: false, text: 'cad:9: translation: out of range' });
  await page.goto(`${page.url()}#device`);
  await page.getByText('Text of the profile').click();
  const box = page.getByRole('textbox', { name: 'Text of the profile' });
  await page.waitForFunction(() => document.querySelector('textarea.code').value !== '');
  const wrong = (await box.inputValue()).replace(/\ntranslation: .*\n/, '\ntranslation: 99\n');
  assert.match(wrong, /\ntranslation: 99\n/);
  await box.fill(wrong);
  await page.getByRole('button', { name: 'Try this text' }).click();
  await page.locator('.newest.error').getByText('cad:9: translation: out of range').waitFor();
  assert.equal(await box.inputValue(), wrong);
  bridge.state.profile.text = bridge.state.profile.text.replace(/\ntranslation: .*\n/, '\ntranslation: 1.2\n');
  bridge.tellState();
  const slider = '#knob-translation[aria-valuetext="1.2"]';
  await page.waitForFunction((there) => document.querySelector(there), slider);
  assert.equal(await box.inputValue(), wrong);
});

onBridge('a recording is started, shown with its progress, stopped and listed', async ({ bridge, page }) => {
  await page.goto(`${page.url()}#record`);
  await page.getByRole('textbox', { name: 'name' }).fill('hand');
  await page.getByRole('combobox', { name: 'keep' }).selectOption('raw');
  await page.getByRole('button', { name: 'Start' }).click();
  const { name, keep } = await asked(bridge, page, 'record_start');
  assert.deepEqual([name, keep], ['hand', 'raw']);
  await page.getByText('hand.twr', { exact: true }).waitFor();
  await page.getByRole('link', { name: /^recording/ }).waitFor();
  bridge.replies.recordings = () => ({ data: [{ name: 'hand.twr', bytes: 5, date: '2026-11-02' }] });
  await page.getByRole('button', { name: 'Stop' }).click();
  await page.getByRole('rowheader', { name: 'hand.twr' }).waitFor();
  await page.locator('.recording-words').getByText(/^Recording ended: \/home.*300 frames/).waitFor();
  assert.equal(
    await page.getByRole('link', { name: 'Download hand.twr' }).getAttribute('href'),
    '/files/recordings/hand.twr',
  );
});

onBridge('a name that is none is not sent', async ({ bridge, page }) => {
  await page.goto(`${page.url()}#record`);
  await page.getByRole('textbox', { name: 'name' }).fill('../../etc');
  await page.getByRole('button', { name: 'Start' }).click();
  await page
    .getByRole('textbox', { name: 'name' })
    .evaluate((box) => box.matches(':invalid') || Promise.reject(new Error('valid')));
  assert.ok(!bridge.asked.some((ask) => ask.ask === 'record_start'));
});

onBridge('a wizard runs from its start to its end, and survives a reload', async ({ bridge, page }) => {
  await page.goto(`${page.url()}#calibrate`);
  await page.locator('[data-verb=wrench]:not([disabled])').click();
  assert.equal((await asked(bridge, page, 'job_start')).options.plan, 'six_orientations');
  const lines = [{ kind: 'task', text: 'put the 50 g on the right bolt' }];
  const job = {
    verb: 'wrench',
    state: 'running',
    lines,
    live: 'steady',
    coverage: { axes: [1, 0.5, 0, 0, 0, 0] },
    progress: 0.2,
    keys: ['skip', 'redo', 'stop'],
    result: null,
  };
  bridge.tellJob(job);
  await page.locator('.job-task').getByText('put the 50 g on the right bolt').waitFor();
  await page.reload();
  await page.locator('.job-task').getByText('put the 50 g on the right bolt').waitFor();
  await page.getByRole('button', { name: 'Skip this step' }).click();
  assert.equal((await asked(bridge, page, 'job_key')).key, 'skip');
  bridge.tellJob({
    ...job,
    state: 'done',
    lines: [...lines, { kind: 'note', text: 'written: /home/u/measured/wrench.json' }],
    keys: [],
  });
  await page.getByText('Next: make the certificate').waitFor();
  await page.locator('.job-task').getByText('Wrench calibration written', { exact: true }).waitFor();
  await page.locator('.job-live').getByText('/home/u/measured/wrench.json', { exact: true }).waitFor();
  await page.locator('.newest.good').getByText('Wrench calibration written: /home/u/measured/wrench.json').waitFor();
  await page.getByRole('button', { name: 'Close' }).click();
  await asked(bridge, page, 'job_close');
  bridge.tellJob(null);
  await page.locator('[data-verb=camera]').waitFor();
});

onBridge('a keyboard alone reaches every view and the controls in it', async ({ page }) => {
  await connected(page);
  for (const view of kViews) {
    await page.evaluate(() => document.activeElement?.blur());
    const link = page.locator(`nav a[href="#${view}"]`);
    for (let i = 0; i < 40 && !(await link.evaluate((one) => one === document.activeElement)); ++i)
      await page.keyboard.press('Tab');
    await page.keyboard.press('Enter');
    await page.locator(`.view-${view}`).waitFor();
    assert.equal(await link.getAttribute('aria-current'), 'page');
    const names = [];
    for (let i = 0; i < 12; ++i) {
      await page.keyboard.press('Tab');
      const inside = await page.evaluate(() => {
        const { activeElement: one } = document;
        if (!one?.closest('main')) return '';
        const outlined = getComputedStyle(one).outlineStyle !== 'none';
        const name =
          one.getAttribute('aria-label') || one.labels?.[0]?.textContent || one.textContent || one.title;
        return outlined && name ? name : `${one.tagName} has no name, or no outline`;
      });
      if (inside !== '') names.push(inside);
    }
    assert.ok(names.length > 0, `${view}: something to press`);
    assert.ok(!names.some((name) => name.includes('has no name')), `${view}: ${names}`);
  }
});

onBridge(
  'no view is wider than a phone of 360 px',
  async ({ page }) => {
    for (const view of kViews) {
      await page.evaluate((name) => (location.hash = name), view);
      await page.locator(`.view-${view}`).waitFor();
      const widths = await page.evaluate(() => [
        document.documentElement.scrollWidth,
        document.documentElement.clientWidth,
      ]);
      assert.ok(widths[0] <= widths[1], `${view}: ${widths}`);
    }
  },
  { options: { viewport: { width: 360, height: 740 } } },
);
