// The core of the tab against the program, on the very same pictures and sensor files: the same sources, compiled twice.
import assert from 'node:assert/strict';
import { File } from 'node:buffer'; // no global of node 18
import { createHash } from 'node:crypto';
import { mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { root, scratch } from './support/environment.mjs';
import { coreModules, coreReason, loadCore, readVectors, run } from './support/core_node.mjs';
import { calibration, kFiles, kSensors } from './support/wrong_sensors.mjs';
import { loadModule } from './support/typescript.mjs';

const kFrames = 60; // 25 at rest, then motion
const scenario = (name) => join(root, 'tests/sim/scenarios', `${name}.yaml`);

function vectors(words, cwd) {
  const ran = run(words, cwd);
  assert.equal(ran.status, 0, ran.stderr);
  return readVectors(words[0] === 'sequence' ? words[3] : words[2]);
}

/** The largest differences, and the median of the largest of each frame in m; the status must be equal in every frame. */
function compare(core, native, files = []) {
  core.open(native.sensor, 'sensor.yaml', ...files);
  const worst = { m: 0, rad: 0, n: 0, nm: 0, sigma: 0 };
  const each = [];
  native.frames.forEach((frame, i) => {
    const sample = core.track(native.frame(i), native.width, native.height, native.width, BigInt(frame.t_ns), i);
    assert.equal(sample.status, frame.status, `frame ${i}`);
    assert.equal(sample.tags_held, frame.tags_held, `frame ${i}`);
    const apart = (ours, first, theirs) => Math.max(...ours.map((value, k) => Math.abs(value - theirs[first + k])));
    const m = apart(sample.d_m, 0, frame.d);
    each.push(m);
    worst.m = Math.max(worst.m, m);
    worst.rad = Math.max(worst.rad, apart(sample.d_rad, 3, frame.d));
    worst.n = Math.max(worst.n, apart(sample.f_n, 0, frame.w));
    worst.nm = Math.max(worst.nm, apart(sample.m_nm, 3, frame.w));
    worst.sigma = Math.max(worst.sigma, ...sample.w_sigma.map((s, k) => (s === frame.w_sigma[k] ? 0 : Math.abs(s / frame.w_sigma[k] - 1))));
  });
  native.close();
  each.sort((a, b) => a - b);
  return { ...worst, median_m: each[each.length >> 1], ok: native.frames.filter((f) => f.status === 'ok').length };
}

/** Vector code of different processors rounds differently, and now and then a pixel is paired with its neighbour: noise is 50 nm. */
function assertAgree(apart) {
  assert.ok(apart.median_m < 3e-9, `median ${apart.median_m} m`);
  assert.ok(apart.m < 6e-8, `largest ${apart.m} m`);
  assert.ok(apart.rad < 2e-5, `largest ${apart.rad} rad`);
  assert.ok(apart.n < 2e-4, `largest ${apart.n} N`);
  assert.ok(apart.nm < 3e-6, `largest ${apart.nm} N m`);
  assert.ok(apart.sigma < 0.02, `sigmas by ${apart.sigma}`);
}

for (const name of ['realistic', 'clean', 'mirrored', 'apriltag', 'grid']) {
  test(`on the ${name} scenario the core reads what the program reads`, { skip: coreReason() }, async (t) => {
    const native = vectors(['sequence', scenario(name), `${kFrames}`, scratch('vectors')]);
    const apart = compare(await loadCore({ finder: true }), native);
    t.diagnostic(JSON.stringify(apart));
    assert.equal(apart.ok, kFrames - 25);
    assertAgree(apart);
  });
}

test('from one rest pose, given with its picture, the core reads what the program reads', { skip: coreReason() }, async (t) => {
  const folder = scratch('given');
  const learning = vectors(['sequence', scenario('realistic'), '40', folder]);
  const core = await loadCore({ finder: true });
  compare(core, learning);
  const mean = new Float64Array(640 * 480);
  const pictures = readVectors(folder);
  for (let i = 0; i < 25; i++) pictures.frame(i).forEach((level, at) => (mean[at] += level / 25));
  pictures.close();
  const { encode } = await import(join(root, 'host/web/pages/node_modules/fast-png/lib/index.js'));
  const picture = encode({ width: 640, height: 480, data: Uint16Array.from(mean, (level) => Math.round(level * 256)), depth: 16, channels: 1 });
  const sha256 = createHash('sha256').update(picture).digest('hex');
  const { 'target.yaml': learned } = core.learned('2026-05-02');
  const target = `${learned}picture: {file: rest.png, frames: 25, sha256: ${sha256}}\n`;
  mkdirSync(join(folder, 'measured'));
  writeFileSync(join(folder, 'measured', 'rest.png'), picture);
  writeFileSync(join(folder, 'measured', 'target.yaml'), target);
  writeFileSync(join(folder, 'sensor.yaml'), learning.sensor);
  const native = vectors(['sequence', scenario('realistic'), `${kFrames}`, folder, 'sensor.yaml'], folder);
  const measured = { 'target.yaml': new TextEncoder().encode(target), 'rest.png': picture };
  const info = core.open(learning.sensor, 'sensor.yaml', undefined, undefined, measured);
  assert.equal(info.rest_given, true);
  assert.equal(info.appearance, true);
  assert.equal(info.in_force[1], 'target: measured/target.yaml, of 2026-05-02');
  assert.deepEqual(core.learned('2026-05-02'), {}, 'nothing had to be learned');
  const apart = compare(core, native, [undefined, undefined, measured]);
  t.diagnostic(JSON.stringify(apart));
  assert.equal(apart.ok, kFrames);
  assertAgree(apart);
  measured['rest.png'] = picture.slice(0, -1);
  assert.throws(() => core.open(learning.sensor, 'sensor.yaml', undefined, undefined, measured), /rest\.png: is not the picture/);
  assert.equal(core.open(learning.sensor, 'sensor.yaml').rest_given, false, 'what was handed in counts once');
});

test('on the real picture, set in motion, the core reads what the program reads', { skip: coreReason('data') }, async (t) => {
  const native = vectors(['semi_real', '150', scratch('semi')]);
  const apart = compare(await loadCore({ finder: true }), native);
  t.diagnostic(JSON.stringify(apart));
  assert.equal(apart.ok, 125);
  assertAgree(apart);
});

test('a calibration is used as the program uses it', { skip: coreReason() }, async () => {
  const folder = scratch('calibrated');
  writeFileSync(join(folder, 'right.json'), calibration());
  writeFileSync(join(folder, 'sensor.yaml'), kSensors['calibrated.yaml'].replace('cy: 239.5', 'cy: 239.5, distortion: [-0.06, 0.02, 4.0e-4, -3.0e-4, 0]'));
  const native = vectors(['sequence', scenario('realistic'), '40', folder, 'sensor.yaml'], folder);
  const apart = compare(await loadCore({ finder: true }), native, [calibration()]);
  assert.equal(apart.ok, 15);
  assertAgree({ ...apart, n: apart.n / 100, nm: apart.nm / 100 }); // its matrix is made up: 100 N for each metre and radian
});

test('sensor files are taken or refused with the program\'s words', { skip: coreReason() }, async () => {
  const folder = scratch('messages');
  for (const [name, text] of Object.entries({ ...kSensors, ...kFiles })) writeFileSync(join(folder, name), text);
  const native = run(['messages', folder]);
  assert.equal(native.status, 0, native.stderr);
  const lines = JSON.parse(native.stdout);
  const core = await loadCore();
  const file = (text, kind) => kFiles[new RegExp(`${kind}: ([a-z_.]+)`).exec(text)?.[1]];
  for (const [name, text] of Object.entries(kSensors)) {
    const picture = file(text, 'appearance');
    let line = '';
    try {
      core.open(text, name, file(text, 'calibration'), picture && new TextEncoder().encode(picture));
    } catch (error) {
      line = error.message;
    }
    assert.equal(line, lines[name]);
    assert.ok(!line.includes('\n'), line);
    if (/right|calibrated\.yaml|every_key/.test(name)) assert.equal(line, '');
    else assert.notEqual(line, '', `${name} was taken`);
  }
});

test('a sensor file that is refused leaves the one before in force', { skip: coreReason() }, async () => {
  const core = await loadCore();
  core.open(kSensors['right.yaml'], 'right.yaml');
  assert.throws(() => core.open('camera: 1', 'wrong.yaml'), /^Error: wrong\.yaml:1: camera: /);
  const sample = core.track(new Uint8Array(640 * 480), 640, 480, 640, 0n, 0);
  assert.equal(sample.status, 'acquiring');
});

test('without a finder the core asks for one and blames nobody', { skip: coreReason() }, async () => {
  const { loadFinder } = await coreModules();
  const native = vectors(['sequence', scenario('clean'), '60', scratch('finder')]);
  const core = await loadCore();
  core.open(native.sensor, 'sensor.yaml');
  assert.equal(core.needsFinder, false);
  const track = (i) => core.track(native.frame(i), 640, 480, 640, BigInt(native.frames[i].t_ns), i);
  for (let i = 0; i < 30; i++) assert.equal(track(i).status, 'acquiring');
  assert.equal(core.needsFinder, true);
  assert.equal(core.hint(), '');
  core.setFinder(await loadFinder());
  assert.equal(core.needsFinder, false);
  native.close();
});

test('a picture of another size or nothing to open is told', { skip: coreReason() }, async () => {
  const core = await loadCore({ finder: true });
  assert.throws(() => core.track(new Uint8Array(16), 4, 4, 4, 0n, 0), /no sensor is open/);
  assert.throws(() => core.learned('2026-05-02'), /not known yet/);
  core.open(kSensors['right.yaml'], 'right.yaml');
  assert.equal(core.track(new Uint8Array(16), 4, 4, 4, 0n, 0).status, 'acquiring');
});

test('why the target is not held is told in the program\'s words', { skip: coreReason() }, async () => {
  const core = await loadCore({ finder: true });
  core.open(kSensors['right.yaml'], 'right.yaml');
  for (let i = 0; i < 40; i++) core.track(new Uint8Array(640 * 480).fill(3), 640, 480, 640, BigInt(i) * 40_000_000n, i);
  assert.match(core.hint(), /the image is black/);
});

test('tags of another family are named as the program names them', { skip: coreReason() }, async () => {
  const folder = scratch('family');
  writeFileSync(join(folder, 'wrong.yaml'), kSensors['right.yaml']);
  const native = vectors(['sequence', scenario('apriltag'), '24', folder, 'wrong.yaml'], folder);
  const core = await loadCore({ finder: true });
  core.open(native.sensor, 'sensor.yaml');
  native.frames.forEach((frame, i) => core.track(native.frame(i), 640, 480, 640, BigInt(frame.t_ns), i));
  native.close();
  assert.match(core.hint(), /of apriltag_36h11 are seen, but sensor\.yaml has tags 5 and 2 of aruco_original/);
  assert.equal(core.hint(), native.frames.map((frame) => frame.hint).filter(Boolean).at(-1));
});

test('the core\'s memory does not grow while it tracks', { skip: coreReason() }, async () => {
  const native = vectors(['sequence', scenario('clean'), `${kFrames}`, scratch('memory')]);
  const core = await loadCore({ finder: true });
  core.open(native.sensor, 'sensor.yaml');
  const track = (i) => core.track(native.frame(i % kFrames), 640, 480, 640, BigInt(i) * 40_000_000n, i);
  for (let i = 0; i < kFrames; i++) track(i);
  const before = core.memoryBytes;
  for (let i = kFrames; i < 2 * kFrames; i++) track(i);
  assert.equal(core.memoryBytes, before);
  native.close();
});

test('the page\'s grid_10x10 is the program\'s', { skip: coreReason() }, async () => {
  const { GRID_10X10 } = await loadModule('sensor/grid_tags.ts');
  const rows = readFileSync(join(root, 'host/core/grid_tags.h'), 'utf8').match(/\{(0x[0-9a-f]{3}(, )?){10}\}/g);
  assert.equal(rows.length, GRID_10X10.ids);
  rows.forEach((row, id) => {
    row.match(/0x[0-9a-f]{3}/g).forEach((bits, r) => {
      for (let c = 0; c < 10; c++) assert.equal(GRID_10X10.white(id, r, c), ((Number(bits) >> (9 - c)) & 1) === 1);
    });
  });
});

test('what people choose is told apart by what it holds', { skip: coreReason() }, async () => {
  const { withFiles } = await loadModule('sensor/sensor_files.ts');
  const file = (name, text) => new File([text], name);
  const sensor = { name: 'sensor.yaml', yaml: kSensors['right.yaml'] };
  const camera = 'image_width: 640\ncamera_matrix: {rows: 3}\n';
  const target = 'format: tagwrench-target-1\npicture: {file: "rest.png"}\n';
  const all = await withFiles(sensor, [
    file('ost.yaml', camera), file('target.yaml', target), file('zero.yaml', 'format: tagwrench-zero-1\n'),
    file('rest.png', 'x'), file('wrench.json', '{}'), file('mine.yaml', kSensors['every_key.yaml']),
  ]);
  assert.equal(all.name, 'mine.yaml');
  assert.equal(all.yaml, kSensors['every_key.yaml'], 'as it was');
  assert.deepEqual(Object.keys(all.measured).sort(), ['camera.yaml', 'rest.png', 'target.yaml', 'wrench.json', 'zero.yaml']);
  assert.equal(new TextDecoder().decode(all.measured['camera.yaml']), camera);
  const more = await withFiles(sensor, [file('wrench.json', '{}')]);
  assert.equal(more.yaml, sensor.yaml);
  assert.deepEqual(Object.keys(more.measured), ['wrench.json']);
  const old = await withFiles(sensor, [file('old.yaml', kSensors['calibrated.yaml']), file('right.json', '{}')]);
  assert.equal(old.calibration, '{}');
  assert.equal(old.measured, undefined);
  await assert.rejects(withFiles(sensor, [file('other.png', 'x')]), /no picture that target\.yaml or sensor\.yaml names/);
  await assert.rejects(withFiles(sensor, [file('a.txt', 'x')]), /not a sensor's file/);
});

test('a change in the form drops what was measured of what was changed', { skip: coreReason() }, async () => {
  const { readKeys, stillMeasured } = await loadModule('sensor/sensor_keys.ts');
  const keys = readKeys(kSensors['right.yaml']);
  const measured = { 'camera.yaml': new Uint8Array(1), 'target.yaml': new Uint8Array(2) };
  assert.deepEqual(stillMeasured(measured, keys, keys), measured);
  assert.deepEqual(Object.keys(stillMeasured(measured, keys, { ...keys, ids: '5, 3' })), ['camera.yaml']);
  assert.deepEqual(stillMeasured(measured, keys, { ...keys, mirrored: true }), {});
});

test('a browser that cannot run the core is told so, and what to do', { skip: coreReason() }, async () => {
  const { checkWebAssembly } = await loadModule('sensor/wasm_support.ts');
  checkWebAssembly();
  const whole = globalThis.WebAssembly;
  const without = (rejects) => ({ validate: (bytes) => bytes.length !== rejects && whole.validate(bytes) });
  const words = [];
  for (const less of [undefined, without(31), without(28)]) {
    globalThis.WebAssembly = less;
    try {
      checkWebAssembly();
    } catch (error) {
      words.push(error.message);
    }
  }
  globalThis.WebAssembly = whole;
  assert.deepEqual(words.map((line) => /does not run|no SIMD|no exceptions/.exec(line)?.[0]), ['does not run', 'no SIMD', 'no exceptions']);
});
