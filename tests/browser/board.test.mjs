// A board behind the bridge, from a page: the firmware itself runs as a process on a pseudo-terminal.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { existsSync, mkdirSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { program, reason, scratch } from './support/environment.mjs';
import { WsPage } from './support/ws.mjs';

const kNewtonsPerCount = 1e-5; // a cell of 0.5 N, with noise of some 40 counts
const firmware = join(dirname(program), '../firmware/tagwrench_board_pc');
const skip = reason('program') || (!existsSync(firmware) && 'the firmware is not built for this computer');
const folder = scratch('board');
const port = join(folder, 'port');
const environment = { ...process.env, XDG_RUNTIME_DIR: folder, XDG_CONFIG_HOME: folder, HOME: folder };
let board;
let bridge;
let page;

/** Resolves with what `part` of the child's lines says first. */
const said = (child, stream, part) =>
  new Promise((resolve, reject) => {
    let text = '';
    child[stream].on('data', (data) => {
      text += data;
      const found = part.exec(text);
      if (found) resolve(found);
    });
    child.on('exit', () => reject(new Error(text)));
  });

function calibrateCells() {
  const { id } = JSON.parse(execFileSync(program, ['board', 'info', '--json', '--port', port], { env: environment, encoding: 'utf8' }));
  const cells = [0, 1, 2, 3].map((channel) => ({
    channel, newtons_per_count: kNewtonsPerCount, newtons_per_count_sigma: 0, zero_counts: 0, zero_sigma_counts: 0, noise_counts: 40, residual_n: 0,
  }));
  mkdirSync(join(folder, 'tagwrench'), { recursive: true });
  writeFileSync(join(folder, 'tagwrench', `board-${id}.json`), JSON.stringify({ format: 'tagwrench-cells-1', board: id, cells }));
}

before(async () => {
  if (skip) return;
  board = spawn(firmware, ['--port', port, '--cell', '0=0.5'], { stdio: ['pipe', 'pipe', 'pipe'] });
  board.lines = '';
  for (const stream of ['stdout', 'stderr']) board[stream].on('data', (data) => (board.lines += data));
  while (!existsSync(port)) await new Promise((resolve) => setImmediate(resolve));
  calibrateCells();
  bridge = spawn(program, ['run', '--source', 'sim', '--board', port, '--output', 'web:127.0.0.1:0'], { stdio: ['ignore', 'ignore', 'pipe'], env: environment });
  const [, number] = await said(bridge, 'stderr', /pages: http:\/\/127\.0\.0\.1:(\d+)\//);
  page = await WsPage.connect(Number(number));
});
after(() => {
  page?.close();
  bridge?.kill();
  board?.kill();
});

const stateWith = (wanted) => page.next((m) => m.type === 'state' && m.board !== null && wanted(m.board));

test('a page sees the board\'s light and load cells in newtons', { skip }, async () => {
  const { can } = await page.next((m) => m.type === 'hello');
  assert.equal(can.led, true);
  const { board: shown } = await stateWith((b) => b.cells.some((cell) => cell.channel === 0));
  assert.ok(shown.cells.every((cell) => Number.isFinite(cell.n) && Number.isFinite(cell.sigma_n)), JSON.stringify(shown));
});

test('the light is as a page requests, and then again as it was settled', { skip }, async () => {
  const { board: first } = await stateWith((b) => b.led > 0);
  assert.equal((await page.ask('led', { level: 0.07 })).ok, true);
  await stateWith((b) => Math.abs(b.led - 0.07) < 0.002);
  assert.match(board.lines, / 70\n/); // permille, by the firmware itself
  assert.equal((await page.ask('led', { level: 'auto' })).ok, true);
  await stateWith((b) => Math.abs(b.led - first.led) < 0.002);
  const answer = await page.ask('led', { level: 2 });
  assert.equal(answer.ok, false);
  assert.match(answer.text, /level/);
});

test('a load cell is tared from a page', { skip }, async () => {
  const before = (await stateWith((b) => b.cells.some((cell) => cell.channel === 0))).board.cells.find((cell) => cell.channel === 0).n;
  assert.ok(Math.abs(before) > 0.01, `${before} N before`);
  const answer = await page.ask('tare', { channel: 0 });
  assert.equal(answer.ok, true, answer.text);
  await stateWith((b) => b.cells.some((cell) => cell.channel === 0 && Math.abs(cell.n) < 0.1 * Math.abs(before)));
  assert.equal((await page.ask('tare', { channel: 9 })).ok, false);
});
