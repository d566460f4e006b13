// The parts of the dashboard that need no browser: what comes over the wire, profiles' texts, the response
// to a push, CSV.
import assert from 'node:assert/strict';
import { existsSync, readFileSync } from 'node:fs';
import { join } from 'node:path';
import test from 'node:test';
import { kProfileText } from './support/fake_bridge_words.mjs';
import { pages, reason, root } from './support/environment.mjs';
import { loadModule } from './support/typescript.mjs';

const skip =
  reason() ||
  (!existsSync(join(pages, 'node_modules/esbuild')) && "the pages' node packages are not fetched");

const kSample = {
  seq: 41,
  t_ns: 123456789,
  status: 'ok',
  d_m: [1e-6, 2e-6, 3e-6],
  d_rad: [0, 0, 1e-4],
  d_sigma: [0, 0, 0, 0, 0, 0],
  f_n: [0.5, 0, -1],
  m_nm: [0, 0.001, 0],
  w_sigma: [0.01, 0.01, 0.02, 1e-4, 1e-4, 1e-4],
  dropped: 0,
  latency_us: 812,
};

test(
  'CSV has the columns of the program, and no numbers where the status carries none',
  { skip },
  async () => {
    const { CSV_HEADER, csvText } = await loadModule('common/csv.ts');
    const source = readFileSync(join(root, 'host/output/line_outputs.h'), 'utf8');
    const columns = [
      ...source
        .slice(source.indexOf('kCsvHeader'))
        .split(';')[0]
        .matchAll(/"([^"]*)"/g),
    ]
      .map((match) => match[1])
      .join('');
    assert.equal(CSV_HEADER, columns.replace('\\n', ''));
    const [, held, lost] = csvText([kSample, { ...kSample, status: 'lost' }]).split('\n');
    assert.equal(held.split(',').length, CSV_HEADER.split(',').length);
    assert.match(held, /^41,123456789,ok,0.000001,/);
    assert.match(lost, /^41,123456789,lost(,0){24},0,812$/);
  },
);

test('a sample that lacks a part, or has one of another kind, is none', { skip }, async () => {
  const { sampleFrom } = await loadModule('common/sample.ts');
  assert.deepEqual(sampleFrom({ ...kSample, newer: 1 }), kSample);
  for (const key of ['seq', 't_ns', 'status', 'd_m', 'f_n', 'm_nm', 'w_sigma']) {
    for (const wrong of [undefined, null, 'x', {}, [1], [1, 2, 'x'], Number.NaN]) {
      assert.equal(sampleFrom({ ...kSample, [key]: wrong }), null, `${key}: ${JSON.stringify(wrong)}`);
    }
  }
  for (const wrong of [null, 5, 'x', [], { status: 'constructor' }]) assert.equal(sampleFrom(wrong), null);
});

test('a picture whose header is cut, too long or no JSON is none', { skip }, async () => {
  const { pictureFrom } = await loadModule('dashboard/protocol.ts');
  const message = (header, length = header.length) => {
    const bytes = Buffer.alloc(4 + header.length + 3, 1);
    bytes.writeUInt32LE(length);
    bytes.write(header, 4);
    return bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length);
  };
  const good = JSON.stringify({
    seq: 1,
    width: 640,
    height: 480,
    tags: [{ id: 5, px: [1, 2, 3, 4, 5, 6, 7, 8] }],
    status: 'ok',
  });
  assert.equal(pictureFrom(message(good)).header.tags[0].px.length, 8);
  assert.equal(pictureFrom(message(good)).jpeg.size, 3);
  for (const wrong of [
    new ArrayBuffer(0),
    new ArrayBuffer(3),
    message(good, 0xffffffff),
    message(good, good.length + 3),
    message('{"seq":'),
  ]) {
    assert.equal(pictureFrom(wrong), null);
  }
});

test('states of an empty, a partial and a broken bridge are read without a throw', { skip }, async () => {
  const { helloFrom, jobFrom, stateFrom } = await loadModule('dashboard/protocol.ts');
  for (const wrong of [
    {},
    { profile: 5, clients: {}, recording: [], board: 'x', job: [], image: [], camera_controls: [null] },
  ]) {
    assert.equal(stateFrom(wrong).status, '');
    assert.equal(helloFrom(wrong).can.led, false);
    assert.equal(jobFrom({ verb: 3, lines: [1], keys: 'x', coverage: { regions: ['a'] } }).lines[0].text, '');
  }
});

test('the longest arrow of a force stays in the picture, from every side', { skip }, async () => {
  const { FARTHEST_MOVE, FIELD_DEG, TIP_LENGTH, forceArrow } = await loadModule('common/force_arrow.ts');
  const { Orbit } = await loadModule('common/orbit.ts');
  const { Matrix4, PerspectiveCamera, Vector3 } = await import(join(pages, 'node_modules/three/build/three.module.js'));
  const camera = new PerspectiveCamera(FIELD_DEG, 1.5, 0.01, 1);
  const heard = {};
  new Orbit(camera, { addEventListener: (name, listener) => (heard[name] = listener) }, () => {});
  const turn = (key) => heard.keydown({ key, preventDefault() {} });
  const directions = [-1, -0.5, 0, 0.5, 1].flatMap((z) =>
    [0, 1, 2, 3, 4, 5, 6, 7].map((k) => new Vector3(Math.cos((k * Math.PI) / 4), Math.sin((k * Math.PI) / 4), 2 * z)),
  );
  directions.push(new Vector3(0, 0, 1), new Vector3(0, 0, -1));
  let farthest = 0;
  for (let i = 0; i < 12; ++i) turn('ArrowDown');
  for (let up = 0; up <= 20; ++up, turn('ArrowUp')) {
    for (let round = 0; round < 63; round += 3) {
      for (let k = 0; k < 3; ++k) turn('ArrowLeft');
      camera.updateMatrixWorld();
      for (const along of directions) {
        const moved = along.clone().normalize().multiplyScalar(FARTHEST_MOVE);
        const arrow = forceArrow(along, 9, new Matrix4().setPosition(moved));
        const tip = arrow.foot.clone().addScaledVector(arrow.along, arrow.length + TIP_LENGTH);
        for (const end of [arrow.foot, tip]) {
          const { x, y } = end.project(camera);
          farthest = Math.max(farthest, Math.abs(x), Math.abs(y));
        }
      }
    }
  }
  assert.ok(farthest < 1, `${farthest} of the way to the edge`);
  assert.ok(farthest > 0.8, `no smaller than it must be: ${farthest}`);
});

test('a changed profile differs in what was changed alone; comments and order stay', { skip }, async () => {
  const { ProfileText } = await loadModule('dashboard/profile_text.ts');
  const text =
    '# mine\nname: mine\naxes:\n  x: {from: x, full_scale_n: 0.6, dead_zone_n: 0.02} # soft\ntranslation: 1\n';
  const changed = new ProfileText(text).with([
    [['axes', 'x', 'full_scale_n'], 0.75],
    [['rotation'], 2],
  ]);
  assert.equal(changed, text.replace('0.6', '0.75') + 'rotation: 2\n');
  assert.equal(new ProfileText(kProfileText).with([]), kProfileText);
  assert.ok(new ProfileText('a: [').broken);
});

test('what is saved keeps what a person wrote around it', { skip }, async () => {
  const { ProfileText, withChanges } = await loadModule('dashboard/profile_text.ts');
  const mine =
    '# what I like\nname: cad        # and its name\naxes:\n  x: {full_scale_n: 0.5}   # light\n' +
    'dominant:\n  ratio: 1.3      # one at a time\n# the end\n';
  const saved = (file, ...changes) =>
    withChanges(file, kProfileText, new ProfileText(kProfileText).with(changes));
  assert.equal(saved(mine), mine);
  const moved = saved(mine, [['axes', 'x', 'full_scale_n'], 0.75], [['dominant', 'ratio'], 2], [['name'], 'my: own']);
  assert.equal(moved, mine.replace('0.5}', '0.75}').replace('1.3 ', '2 ').replace('cad ', '"my: own" '));

  const axes = ['x', 'y', 'z', 'rx', 'ry', 'rz'];
  const curves = (power, among = axes) => among.map((axis) => [['axes', axis, 'curve', 'power'], power]);
  const added = saved(mine, [['rotation'], 2], [['gestures', 'tap_force_n'], 0.3], ...curves(1.7));
  assert.equal(new ProfileText(added).number(['rotation'], 0), 2);
  assert.equal(new ProfileText(added).number(['gestures', 'tap_force_n'], 0), 0.3);
  assert.match(added, /\ncurve: \{power: 1.7\}\n/);
  for (const comment of mine.match(/#.*/g)) assert.ok(added.includes(comment), comment);
  assert.equal(saved('{name: cad, lock: none}\n', [['lock'], 'rotation']), '{name: cad, lock: rotation}\n');
  const aliased = 'axes: {x: &x {full_scale_n: 1}, y: *x}\n';
  assert.match(saved(aliased, [['axes', 'y', 'full_scale_n'], 2]), /^name: "cad"\n/, 'all of it');
  assert.equal(saved('name: cad\n', ...curves(1.7, ['ry'])), 'name: cad\naxes:\n  ry:\n    curve:\n      power: 1.7\n');
});

test('every knob writes where it reads, within its bounds', { skip }, async () => {
  const { ProfileText } = await loadModule('dashboard/profile_text.ts');
  const { knobsOf, placeOf, valueAt } = await loadModule('dashboard/knobs.ts');
  const knobs = (text) => knobsOf(new ProfileText(text)).flatMap((group) => group.knobs);
  assert.equal(knobs(kProfileText).length, 30);
  for (const [index, knob] of knobs(kProfileText).entries()) {
    const value = knob.kind === 'slider' ? valueAt(knob, 0.7) : knob.values.at(-1);
    const changed = new ProfileText(kProfileText).with(knob.paths.map((path) => [path, value]));
    const again = knobs(changed).find(
      (other) => other.label === knob.label && other.paths[0].join() === knob.paths[0].join(),
    );
    assert.equal(again?.value, value, `${index} ${knob.label}`);
    if (knob.kind !== 'slider') continue;
    assert.ok(
      Math.abs(placeOf({ ...knob, value }) - 0.7) < 0.01,
      `${knob.label}: three digits are near the place`,
    );
    assert.ok(valueAt(knob, 0) >= knob.lowest && valueAt(knob, 1) <= knob.highest, knob.label);
  }
});

test(
  'the response is zero within the dead zone, full at full scale, and continuous both ways',
  { skip },
  async () => {
    const { curveAt, deflection } = await loadModule('dashboard/response.ts');
    const shape = {
      full: 0.6,
      dead: 0.02,
      release: 0.7,
      limit: 1,
      gain: 1,
      curve: { power: 1.6, points: null },
    };
    assert.equal(deflection(shape, 0.02), 0);
    assert.equal(deflection(shape, -0.6), -1);
    assert.equal(deflection({ ...shape, limit: 0.5 }, 2), 0.5);
    assert.equal(deflection(shape, 0.016), 0);
    assert.ok(deflection(shape, 0.016, true) > 0, 'the way back ends at 0.7 of the dead zone');
    assert.ok(Math.abs(deflection(shape, 0.3) - ((0.3 - 0.014) / (0.6 - 0.014)) ** 1.6) < 1e-12);
    for (let push = 0; push < 0.6; push += 1e-3) {
      for (const back of [false, true])
        assert.ok(Math.abs(deflection(shape, push + 1e-3, back) - deflection(shape, push, back)) < 0.01);
    }
    // As host/motion/shaping.cpp has it: through the points, never falling, never beyond them.
    const curve = {
      power: 1,
      points: [
        [0, 0],
        [0.5, 0.2],
        [0.8, 0.2],
        [1, 1],
      ],
    };
    for (const [x, y] of curve.points) assert.ok(Math.abs(curveAt(curve, x) - y) < 1e-12);
    for (let x = 0; x < 1; x += 0.01)
      assert.ok(curveAt(curve, x + 0.01) >= curveAt(curve, x) - 1e-12, `at ${x}`);
    assert.ok(Math.abs(curveAt(curve, 0.65) - 0.2) < 1e-12, 'flat between equal points');
  },
);
