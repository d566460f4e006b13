// Makes docs/moving.webp, the moving picture of the README: `./run picture`, or node docs/moving_picture.mjs [OUT.webp]
//
// It takes the program and the dashboard (`./run web` builds both), and of Debian: chromium, nodejs, sqlite3, webp. With
// TAGWRENCH_KEEP_FRAMES=FOLDER the single pictures stay there.
//
// A simulated hand pushes the platform along x, y and z and turns it about x, y and z. The pictures of the simulated
// camera go through `tagwrench record`; what it measured is played to the real dashboard, one frame after the other, however
// long the browser takes to draw one. Nothing is shown that was not measured: the last picture joins the first, so the
// seconds before the first one are those of the round before.
import { spawnSync } from 'node:child_process';
import { copyFileSync, mkdirSync, readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { basename, join, resolve } from 'node:path';
import { openChromium, openPage } from '../tests/browser/support/chromium.mjs';
import { program, reason, root, scratch, webBuild } from '../tests/browser/support/environment.mjs';
import { FakeBridge } from '../tests/browser/support/fake_bridge.mjs';

const kOut = resolve(process.argv[2] ?? join(root, 'docs/moving.webp'));
const kFps = 25;
const kEvery = 3; // of the camera's pictures one is shown
const kPushFrames = 32;
const kLearnFrames = 40; // at rest, before the first push
const kAxes = [
  ['fx', 0.65],
  ['fy', -0.65],
  ['fz', -1.9],
  ['mx', 0.012],
  ['my', 0.012],
  ['mz', -0.0075],
];
const kShown_s = 20; // of the dashboard's traces
const kQuality = 60; // of WebP; a whole picture now and then wipes away what lossy differences leave
const kWidth = 920;
const kHeight = 540;

/** Of the dashboard, what a small picture has room for. */
const kLayout = `
  header, nav, footer, .panel-run, .gauges, .picture-toggle, .panel-traces button,
  .readings-sums, .readings-actions, .readings thead, .readings .sigma, .readings .peak { display: none !important; }
  html { scrollbar-gutter: auto !important; overflow: hidden !important; }
  body, main { overflow: hidden !important; scrollbar-gutter: auto !important; }
  .view-live { height: ${kHeight - 24}px; align-items: stretch !important; grid-template: auto 1fr / 312px minmax(0, 1fr) 232px !important;
    grid-template-areas: 'camera traces numbers' 'platform traces numbers' !important; }
  .view-live .column { display: contents !important; }
  .panel-camera { grid-area: camera; }
  .panel-platform { grid-area: platform; }
  .panel-traces { grid-area: traces; height: auto !important; }
  .panel-numbers { grid-area: numbers; display: grid; grid-template-rows: auto minmax(0, 1fr); padding-bottom: 36px !important; }
  .readings { height: 100%; }
  .traces { min-height: 0; grid-template-rows: repeat(5, minmax(0, 1fr)) minmax(0, 1.28fr); }
  .panel-traces, .panel-platform { min-height: 0 !important; }
  .platform { height: 150px; min-height: 0; }
`;

function run(command, args) {
  const made = spawnSync(command, args, { encoding: 'utf8', maxBuffer: 1 << 28 });
  if (made.status !== 0) throw new Error(`${command} ${args.join(' ')}: ${made.stderr ?? made.error}`);
  return made.stdout;
}

/** A folder of pictures in which each axis is pushed in turn, as a source of the program. */
function renderPushes(folder) {
  const all = join(folder, 'all');
  mkdirSync(all);
  const times = ['file,t_ns'];
  for (const [index, [axis, size]] of kAxes.entries()) {
    const rest = index === 0 ? kLearnFrames : 0;
    const amplitude = kAxes.map(([, other]) => Math.abs(other));
    const one = join(folder, axis);
    const scenario = join(folder, `${axis}.yaml`);
    writeFileSync(
      scenario,
      `seed: 1\nexposure: {time_ms: 1, even: true}\ncamera: {fps: ${kFps}}\n` +
        `trajectory: {motion: push, axis: ${axis}, share: ${Math.sign(size)}, rest_s: ${rest / kFps + 0.1}, hold_s: 0.2, ` +
        `amplitude: [${amplitude.join(', ')}]}\n`,
    );
    run(program, ['sim', '--scenario', scenario, '--out', one, '--frames', String(rest + kPushFrames)]);
    for (const file of readdirSync(one).filter((name) => name.endsWith('.png')).sort()) {
      const number = times.length - 1;
      const name = `${String(number).padStart(6, '0')}.png`;
      copyFileSync(join(one, file), join(all, name));
      times.push(`${name},${Math.round((number * 1e9) / kFps)}`);
    }
    copyFileSync(join(one, 'sensor.yaml'), join(all, 'sensor.yaml'));
  }
  writeFileSync(join(all, 'frames.csv'), `${times.join('\n')}\n`);
  return all;
}

/** What the program measured in them: samples as the dashboard gets them, with the tags' corners. */
function measure(folder, pictures) {
  const recording = join(folder, 'pushes.twr');
  const sensor = join(pictures, 'sensor.yaml');
  run(program, ['record', '--source', `images:${pictures}`, '--sensor', sensor, '--out', recording, '--fast']);
  const columns = (...names) => names.map((name) => `s.${name}`).join(', ');
  const rows = JSON.parse(
    run('sqlite3', [
      '-json',
      recording,
      `select s.seq, s.t_ns, s.status, s.dropped, ${columns('x', 'y', 'z', 'rx', 'ry', 'rz')}, ` +
        `${columns('sigma_x', 'sigma_y', 'sigma_z', 'sigma_rx', 'sigma_ry', 'sigma_rz')}, ` +
        `${columns('fx', 'fy', 'fz', 'mx', 'my', 'mz')}, ` +
        `${columns('sigma_fx', 'sigma_fy', 'sigma_fz', 'sigma_mx', 'sigma_my', 'sigma_mz')}, ` +
        't.residual_px, t.tags_held, hex(t.corners) corners from samples s join tracks t using (id) order by s.id',
    ]),
  );
  return rows.map((row) => {
    const of = (...names) => names.map((name) => row[name]);
    const blob = Buffer.from(row.corners, 'hex');
    const tags = [];
    for (let at = 0; at < blob.length; at += 72) {
      const numbers = Array.from({ length: 9 }, (_, i) => blob.readDoubleLE(at + 8 * i));
      tags.push({ id: numbers[0], px: numbers.slice(1) });
    }
    const sample = {
      ...{ seq: row.seq, t_ns: row.t_ns, status: row.status, dropped: row.dropped, latency_us: 0 },
      d_m: of('x', 'y', 'z'),
      d_rad: of('rx', 'ry', 'rz'),
      d_sigma: of('sigma_x', 'sigma_y', 'sigma_z', 'sigma_rx', 'sigma_ry', 'sigma_rz'),
      f_n: of('fx', 'fy', 'fz'),
      m_nm: of('mx', 'my', 'mz'),
      w_sigma: of('sigma_fx', 'sigma_fy', 'sigma_fz', 'sigma_mx', 'sigma_my', 'sigma_mz'),
      ...{ zero: [0, 0, 0, 0, 0, 0], motion: [0, 0, 0, 0, 0, 0], zero_state: 'off', buttons: 0 },
      ...{ residual_px: row.residual_px, tags_held: row.tags_held },
    };
    return { sample, tags };
  });
}

function pictureMessage(png, { sample, tags }) {
  const header = Buffer.from(
    JSON.stringify({ seq: sample.seq, t_ns: sample.t_ns, width: 640, height: 480, tags, status: sample.status }),
  );
  const length = Buffer.alloc(4);
  length.writeUInt32LE(header.length);
  return Buffer.concat([length, header, png]);
}

const missing = reason('chromium', 'program', 'dashboard');
if (missing) {
  console.error(`no picture: ${missing}`);
  process.exit(1);
}
const folder = scratch('moving');
const pictures = renderPushes(folder);
const measured = measure(folder, pictures);
const round = measured.slice(kLearnFrames);
if (round.length !== kAxes.length * kPushFrames || round.some(({ sample }) => sample.status !== 'ok'))
  throw new Error(`${round.length} frames, of which not ok: ${round.filter(({ sample }) => sample.status !== 'ok').length}`);

const bridge = new FakeBridge({ pages: join(webBuild, 'dashboard') });
bridge.silent = true; // what it would tell is made up
bridge.replies.pictures = () => ({});
Object.assign(bridge.hello, {
  ...{ range_n: [0.9, 0.9, 2.5], range_nm: [0.016, 0.016, 0.009] },
  source: `simulated sensor, 640x480 at ${kFps} Hz`,
  axes_from_springs: [],
});
await bridge.start();
const browser = await openChromium();
const { page, faults } = await openPage(browser, bridge.url, {
  viewport: { width: kWidth, height: kHeight },
  bypassCSP: true, // for the layout below
  colorScheme: 'dark',
  reducedMotion: 'reduce', // traces end at the newest sample, whatever the clock says
});
await page.locator('.trace canvas').first().waitFor();
await page.addStyleTag({ content: kLayout });

const length_ns = (round.length * 1e9) / kFps;
const shifted = ({ sample }, rounds) => ({ ...sample, t_ns: sample.t_ns + rounds * length_ns });
const tell = (samples) => bridge.sendAll(JSON.stringify({ type: 'samples', samples, lost: 0 }));
const rounds = Math.ceil((kShown_s * kFps) / round.length);
for (let i = -rounds; i < 0; ++i) {
  const before = round.map((frame) => shifted(frame, i));
  for (let at = 0; at < before.length; at += 64) tell(before.slice(at, at + 64));
}

const shots = [];
for (let at = 0; at < round.length; at += kEvery) {
  const frame = round[at];
  tell(round.slice(at, at + kEvery).map((one) => shifted(one, 0)));
  bridge.sendAll(pictureMessage(readFileSync(join(pictures, `${String(kLearnFrames + at).padStart(6, '0')}.png`)), frame));
  await page.waitForTimeout(250); // the platform is drawn ten times a second where the processor draws
  shots.push(join(folder, `shot${String(shots.length).padStart(3, '0')}.png`));
  await page.screenshot({ path: shots.at(-1) });
}
await browser.close();
await bridge.stop();
if (faults.length > 0) throw new Error(faults.join('\n'));
const keep = process.env.TAGWRENCH_KEEP_FRAMES;
if (keep) for (const shot of shots) copyFileSync(shot, join(keep, basename(shot)));
const forEach = ['-lossy', '-q', String(kQuality), '-m', '6', '-d', String((1000 * kEvery) / kFps)];
run('img2webp', ['-loop', '0', '-kmin', '3', '-kmax', '9', ...forEach, ...shots, '-o', kOut]);
console.log(`${kOut}: ${shots.length} pictures, ${(readFileSync(kOut).length / 1024).toFixed(0)} KiB`);
