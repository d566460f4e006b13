// The bridge behind the pages, over a raw WebSocket: what it shows of the simulated sensor, and what it does for a page.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import path from 'node:path';
import { after, before, test } from 'node:test';
import { WsPage, rawExchange } from './support/ws.mjs';

const program = process.env.TAGWRENCH_PROGRAM ?? '/nonexistent';
const lacks = existsSync(program) ? false : `${program} is not built`;
const folder = mkdtempSync(path.join(tmpdir(), 'tagwrench-bridge-'));
const at = (...names) => path.join(folder, ...names);
const environment = { ...process.env, XDG_RUNTIME_DIR: folder, XDG_CONFIG_HOME: at('config'), HOME: folder };
const running = new Set();

/** A bridge on a port of its own, and a page of it. */
async function startBridge(more = []) {
  const args = ['run', '--source', 'sim', '--output', 'web:127.0.0.1:0', '--recordings', at('recordings'), ...more];
  const child = spawn(program, args, { stdio: ['ignore', 'ignore', 'pipe'], env: environment });
  running.add(child);
  child.said = '';
  child.ended = new Promise((resolve) => child.on('exit', (code, signal) => resolve({ code, signal })));
  child.ended.then(() => running.delete(child));
  const port = await new Promise((resolve, reject) => {
    child.stderr.on('data', (part) => {
      child.said += part;
      const found = /pages: http:\/\/127\.0\.0\.1:(\d+)\//.exec(child.said);
      if (found) resolve(Number(found[1]));
    });
    child.ended.then(() => reject(new Error(child.said)));
  });
  const page = await WsPage.connect(port);
  const hello = await page.next((m) => m.type === 'hello');
  return { child, port, page, hello };
}

const someSample = (wanted) => (m) => m.type === 'samples' && m.samples.some(wanted);
const jobOver = (verb) => (m) => m.type === 'job' && m.job?.verb === verb && m.job.state !== 'running';

/** A file of a process in /proc; empty where the process is gone, also where it goes during the read (ESRCH). */
function processFile(pid, name) {
  try {
    return readFileSync(`/proc/${pid}/${name}`, 'utf8');
  } catch (error) {
    if (error.code === 'ENOENT' || error.code === 'ESRCH') return '';
    throw error;
  }
}

/** Processes that the bridge has started. */
function childrenOf(pid) {
  const tasks = readdirSync(`/proc/${pid}/task`);
  return tasks.flatMap((task) => processFile(pid, `task/${task}/children`).split(' ').filter((id) => id !== ''));
}

/** The job that the bridge runs. There must be one: that none has ended proves nothing. */
function jobOf(pid) {
  const job = childrenOf(pid).find((id) => processFile(id, 'cmdline').includes('--events'));
  assert.ok(job, `process ${pid} runs no job`);
  return Number(job);
}

/** A request that fails, and says why. */
async function refused(page, what, args, why) {
  const answer = await page.ask(what, args);
  assert.equal(answer.ok, false, `${what} ${JSON.stringify(args)}: ${answer.text}`);
  assert.match(answer.text, why);
}

before(() => {
  if (lacks) return;
  const made = spawnSync(program, ['sim', '--out', at('sensor'), '--frames', '1'], { env: environment });
  assert.equal(made.status, 0, String(made.stderr));
});
after(() => {
  for (const child of running) child.kill('SIGKILL');
  rmSync(folder, { recursive: true, force: true });
});

test('a page sees samples and state, and its requests are answered', { skip: lacks }, async () => {
  const { child, page, hello } = await startBridge(['--profile', 'cad', '--profile', 'game']);
  assert.equal(hello.protocol, 1);
  assert.deepEqual(hello.can.jobs, ['doctor']); // there is no sensor.yaml to write to
  const { samples } = await page.next(someSample((s) => s.status === 'ok'));
  assert.equal(samples.at(-1).f_n.length, 3);
  const state = await page.next((m) => m.type === 'state' && m.status === 'ok' && m.rate_hz > 0);
  assert.equal(state.words, 'held');
  assert.equal(state.profile.name, 'cad');
  assert.match((await page.ask('zero')).text, /as soon as/);
  assert.equal((await page.ask('next_profile')).text, 'game');
  await page.next((m) => m.type === 'state' && m.profile?.name === 'game');
  await page.next((m) => m.type === 'say' && m.line.startsWith('profile: game'));

  const shown = await page.ask('show', { name: 'cad' });
  const tried = await page.ask('try', { name: 'cad', text: shown.text.replace(/rate_hz: \d+/, 'rate_hz: 60') });
  assert.ok(tried.ok, tried.text);
  assert.match(tried.text, /rate_hz: 60/);
  assert.match(shown.data.written, /^# /, 'what people are told about it');
  const mine = { name: 'cad', as: 'cad-mine', text: tried.text.replace('"cad"', '"cad-mine"') };
  await refused(page, 'save_profile', { ...mine, text: tried.text }, /its name is cad, and not cad-mine/);
  await refused(page, 'save_profile', { ...mine, file_text: 'curve: {powr: 2}' }, /cad-mine.yaml:1: curve/);
  const saved = await page.ask('save_profile', { ...mine, file_text: `# mine\n${mine.text}` });
  assert.ok(saved.ok, saved.text);
  const file = at('config', 'tagwrench', 'profiles', 'cad-mine.yaml');
  assert.equal(readFileSync(file, 'utf8'), `# mine\n${mine.text}`);
  await refused(page, 'save_profile', mine, /is there already; choose another/);

  await refused(page, 'profile', { name: 'chess' }, /no profile 'chess'/);
  await refused(page, 'profile', { name: 'a\nb' }, /one line/);
  await refused(page, 'try', { name: 'cad', text: 'curve: {powr: 2}' }, /cad:1: curve/);
  await refused(page, 'make_coffee', {}, /reload the page/);
  await refused(page, 'led', { level: 0.5 }, /no board/);
  await refused(page, 'led', { level: 7 }, /from 0 to 1/);
  await refused(page, 'tare', { channel: 0 }, /no board/);
  await refused(page, 'camera_set', { control: 1, value: 2 }, /there is none/);
  await refused(page, 'job_start', { verb: 'target' }, /--sensor FILE/);
  await refused(page, 'job_start', { verb: 'sh' }, /none of camera/);
  await refused(page, 'job_key', { key: 'skip' }, /no job runs/);
  child.kill('SIGINT');
  assert.equal((await page.closed).code, 1001);
  assert.deepEqual(await child.ended, { code: 0, signal: null });
});

test('of two pages that try a profile at the same instant one is refused', { skip: lacks }, async () => {
  const { child, page, port } = await startBridge(['--profile', 'cad']);
  const other = await WsPage.connect(port);
  await page.next((m) => m.type === 'state' && m.profile?.name === 'cad');
  const { text } = await page.ask('show', { name: 'cad' });
  for (let i = 0; i < 10; i++) {
    const both = await Promise.all([page, other].map((one) => one.ask('try', { name: 'cad', text })));
    const [taken, left] = both[0].ok ? both : [...both].reverse();
    assert.ok(taken.ok, taken.text);
    assert.ok(!left.ok);
    assert.match(left.text, /^another page tries profile cad; keep or revert it there/);
    assert.ok((await (both[0].ok ? page : other).ask('revert')).ok);
  }
  // One that was refused by the desk is in nobody's way.
  await refused(page, 'try', { name: 'cad', text: 'curve: {powr: 2}' }, /cad:1: curve/);
  assert.ok((await other.ask('try', { name: 'cad', text })).ok);
  child.kill('SIGINT');
  await child.ended;
});

test('a recording begins, shows how it goes, ends and replays', { skip: lacks }, async () => {
  const { child, page, port } = await startBridge();
  await page.next(someSample((s) => s.status === 'ok'));
  await refused(page, 'record_start', { name: '../push' }, /name: must be/);
  await refused(page, 'record_stop', {}, /none runs/);
  const begun = await page.ask('record_start', { name: 'push', keep: 'region' });
  assert.ok(begun.ok, begun.text);
  await refused(page, 'record_start', { name: 'other' }, /runs already/);
  await page.next((m) => m.type === 'state' && m.recording?.frames >= 20);
  const stopped = await page.ask('record_stop');
  assert.ok(stopped.ok, stopped.text);
  await refused(page, 'record_start', { name: 'push' }, /choose another/);
  const { data } = await page.ask('recordings');
  assert.equal(data[0].name, 'push.twr');
  const download = await rawExchange(
    port, `GET /files/recordings/push.twr HTTP/1.1\r\nHost: 127.0.0.1:${port}\r\nConnection: close\r\n\r\n`);
  assert.match(download, /^HTTP\/1\.1 200 /);
  child.kill('SIGINT');
  await child.ended;
  const args = ['run', '--source', `recording:${at('recordings', 'push.twr')}`, '--fast', '--output', 'jsonl:-'];
  const replayed = spawnSync(program, args, { env: environment });
  assert.equal(replayed.status, 0, String(replayed.stderr));
  assert.ok(String(replayed.stdout).trim().split('\n').length >= 20);
});

test('a calibration has the camera, writes measured/, and the sensor runs on with it', { skip: lacks }, async () => {
  const sensor = at('sensor', 'sensor.yaml');
  const before = readFileSync(sensor, 'utf8');
  const { child, page } = await startBridge(['--sensor', sensor, '--output', `jsonl:${at('all.jsonl')}`]);
  await page.next(someSample((s) => s.status === 'ok'));
  await page.ask('pictures', { on: true });
  const begun = await page.ask('job_start', { verb: 'target', options: { seconds: 12 } });
  assert.ok(begun.ok, begun.text);
  await refused(page, 'job_start', { verb: 'doctor' }, /runs already/);
  const other = await WsPage.connect((await page.ask('recordings')) && Number(/:(\d+)\//.exec(child.said)[1]));
  await other.next((m) => m.type === 'state' && m.job?.verb === 'target'); // any page sees it
  await page.next((m) => m.type === 'job' && m.job.coverage?.keyframes > 0);
  page.destroy(); // and goes on without the one that began it
  const { job } = await other.next(jobOver('target'));
  assert.equal(job.state, 'done', JSON.stringify(job.lines));
  assert.match(job.lines.at(-1).text, /^written: /);
  assert.equal(readFileSync(sensor, 'utf8'), before);
  assert.match(readFileSync(at('sensor', 'measured', 'target.yaml'), 'utf8'), /position_mm/);
  // Long enough for the numbers of the next run to begin below those of this one.
  await other.nextNew(someSample((s) => s.status === 'ok' && s.seq >= 100));

  await other.ask('job_close');
  await other.ask('job_start', { verb: 'zero' });
  assert.equal((await other.next(jobOver('zero'))).job.state, 'done');
  assert.match(readFileSync(at('sensor', 'measured', 'zero.yaml'), 'utf8'), /zero_n/);
  await other.nextNew(someSample((s) => s.status === 'ok'));
  child.kill('SIGINT');
  assert.equal((await child.ended).code, 0);
  const lines = readFileSync(at('all.jsonl'), 'utf8').trim().split('\n').map((line) => JSON.parse(line));
  const begins = lines.filter((line, i) => i === 0 || line.seq < lines[i - 1].seq);
  assert.equal(begins.length, 3, 'the file goes on where the run before has ended');
});

test('a job that is stopped, killed or cannot be leaves a sensor that runs', { skip: lacks }, async () => {
  const sensor = at('sensor', 'sensor.yaml');
  const { child, page } = await startBridge(['--sensor', sensor]);
  await page.next(someSample((s) => s.status === 'ok'));
  const before = readFileSync(sensor, 'utf8');
  const start = (options) => page.ask('job_start', { verb: 'wrench', options: { plan: 'six_orientations', ...options } });
  assert.ok((await start()).ok);
  await page.next((m) => m.type === 'job' && m.job.coverage?.axes);
  process.kill(jobOf(child.pid), 'SIGKILL');
  const { job } = await page.next(jobOver('wrench'));
  assert.equal(job.state, 'failed');
  assert.match(job.lines.at(-1).text, /ended from outside/);
  await page.nextNew(someSample((s) => s.status === 'ok'));

  assert.ok((await start({ force: true })).ok);
  await page.nextNew((m) => m.type === 'job' && m.job.state === 'running' && m.job.coverage?.axes);
  assert.ok((await page.ask('job_key', { key: 'skip' })).ok);
  assert.ok((await page.ask('job_key', { key: 'stop' })).ok);
  assert.equal((await page.nextNew(jobOver('wrench'))).job.state, 'stopped');
  await page.nextNew(someSample((s) => s.status === 'ok'));
  assert.equal(readFileSync(sensor, 'utf8'), before);

  // What a job leaves cannot be used: the bridge stays, says why, and tries again.
  assert.ok((await start({ force: true })).ok);
  await page.nextNew((m) => m.type === 'job' && m.job.state === 'running' && m.job.coverage?.axes);
  writeFileSync(sensor, 'camera: {width: nothing}\n');
  await page.ask('job_key', { key: 'stop' });
  const wrong = await page.nextNew((m) => m.type === 'state' && /sensor\.yaml:1/.test(m.words));
  assert.equal(wrong.status, 'lost');
  writeFileSync(sensor, before);
  assert.ok((await page.ask('retry')).ok);
  await page.nextNew(someSample((s) => s.status === 'ok'));

  // No job outlives the bridge, not even one that can do nothing itself: a stopped one does not see its pipes close.
  assert.ok((await start({ force: true })).ok);
  await page.nextNew((m) => m.type === 'job' && m.job.state === 'running' && m.job.coverage?.axes);
  const orphan = jobOf(child.pid);
  process.kill(orphan, 'SIGSTOP');
  child.kill('SIGKILL');
  await child.ended;
  const ended = () => /^$|\) Z /.test(processFile(orphan, 'stat'));
  const limit = Date.now() + 30_000;
  while (!ended() && Date.now() < limit) await new Promise((resolve) => setImmediate(resolve));
  const outlived = !ended();
  if (outlived) process.kill(orphan, 'SIGKILL');
  assert.ok(!outlived, 'the job outlives the bridge');
  assert.equal(readFileSync(sensor, 'utf8'), before);
});
